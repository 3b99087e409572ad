from types import TracebackType
from typing import Iterator, List, Optional, Sequence, Type

__version__: str
protocol_version: int

MANIPULATOR: int
OBSERVER: int
OPERATOR: int
JOINED: int
SESSION_ENDED: int
BUTTON_GRAB: int
BUTTON_CLUTCH: int
EVENT_STATE: int
EVENT_JOINED: int
EVENT_USER_JOINED: int
EVENT_USER_LEFT: int
EVENT_GRABBED: int
EVENT_RELEASED: int
EVENT_PARAMETER_SET: int
EVENT_LAW_SET: int
EVENT_REFUSED: int
EVENT_POSE_ANSWERED: int
EVENT_NEWS: int
EVENT_LOG: int
BAD_HANDLE: int
BAD_ARGUMENT: int
BAD_STATE: int
SETUP_FAILED: int
ENDED: int
TIMED_OUT: int

class Error(RuntimeError):
    status: int

class Pose:
    @property
    def position_m(self) -> List[float]: ...
    @property
    def rotation_wxyz(self) -> List[float]: ...

class Wrench:
    @property
    def force_n(self) -> List[float]: ...
    @property
    def torque_n_m(self) -> List[float]: ...

class Body:
    id: int
    held_by: int
    name: str
    pose_W: Pose

class User:
    id: int
    role: int
    holds: int
    name: str
    tool_W: Pose

class Session:
    state: int
    user: int
    role: int
    reconnects: int
    lost_ticks: int
    lost_events: int
    device: str
    round_trip_s: float
    room: str
    law: str
    stage: str
    reason: str
    note: str

class Event:
    kind: int
    user: int
    body: int
    code: int
    tag: int
    value: float
    text: str

class Force:
    is_stale: bool
    on_hand_D: Wrench
    commands: int

class Snapshot:
    has_tick: bool
    has_state: bool
    step: int
    server_faults: int
    number: int
    time_ns: int
    state_age_s: float
    safety: int
    held_body: int
    handle_W: Pose
    tool_W: Pose
    on_hand_D: Wrench

class Ticks:
    """Ticks of the haptic loop. Each field is a view of all ticks without a copy; vectors have the shape (ticks, 3)."""

    number: memoryview
    server_step: memoryview
    time_ns: memoryview
    safety: memoryview
    state_age_s: memoryview
    held_body: memoryview
    device_position_m: memoryview
    handle_position_m: memoryview
    handle_velocity_m_per_s: memoryview
    tool_position_m: memoryview
    force_n: memoryview
    def __len__(self) -> int: ...

class OwnDevice:
    """A device that this program feeds, 200 to 2000 times a second. If the feed stalls, the force is zero 20 ms later."""

    def __init__(
        self,
        name: str = "python",
        senses_rotation: bool = False,
        displays_torque: bool = False,
        force_limit_n: float = 0,
        force_maximum_n: float = 0,
        maximum_source: str = "",
    ) -> None: ...
    def feed(
        self,
        position_m: Sequence[float],
        rotation_wxyz: Sequence[float] = (1, 0, 0, 0),
        buttons: int = 0,
        velocity_m_per_s: Optional[Sequence[float]] = None,
    ) -> None: ...
    def force(self) -> Force: ...

class Client:
    """A client of a room. `with` joins and starts it; at its end the force falls to zero and the client leaves."""

    def __init__(
        self,
        *,
        server: str = "",
        room: str = "",
        user_name: str = "",
        invitation: str = "",
        pin: str = "",
        authorities: str = "",
        token: str = "",
        is_insecure: bool = False,
        role: int = 0,
        uses_tcp: bool = False,
        own_device: Optional[OwnDevice] = None,
        device: str = "",
        profile: str = "",
        hand: str = "",
        stage: str = "",
        predictor: str = "",
        has_passivity: bool = True,
        realtime_priority: int = 0,
        has_simulated_link: bool = False,
        firmware: str = "",
        motor_counts_per_n_m: float = 0,
        library: str = "",
        service: str = "",
        motors: str = "",
    ) -> None: ...
    def __enter__(self) -> Client: ...
    def __exit__(
        self,
        kind: Optional[Type[BaseException]],
        error: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None: ...
    def join(self) -> None: ...
    def wait_joined(self, timeout_s: float = 20) -> None: ...
    def wait_event(self, timeout_s: float) -> bool:
        """Returns False after the time-out. Ctrl-C ends this and all other waits."""
    def start(self) -> None: ...
    def stop(self) -> None: ...
    def close(self) -> None: ...
    def session(self) -> Session: ...
    def snapshot(self) -> Snapshot: ...
    def bodies(self) -> List[Body]: ...
    def users(self) -> List[User]: ...
    def read_ticks(self, most: int = 4096) -> Ticks: ...
    def events(self, timeout_s: float = 0) -> Iterator[Event]:
        """Iterates over the events, waits for further ones, and ends after `timeout_s` without an event."""
    def grab(self, body: int = 0) -> None: ...
    def release(self) -> None: ...
    def point(self, place_W_m: Sequence[float], body: int = 0) -> None: ...
    def set_parameter(self, name: str, value: float) -> None: ...
    def set_law(self, law: str) -> None: ...
    def set_stage(self, stage: str, predictor: str = "", has_passivity: bool = True) -> None: ...
    def set_link(self, delay_s: float, jitter_s: float = 0, loss: float = 0) -> None: ...
    def reset_room(self) -> None: ...
    def change_room(self, room: str) -> None: ...
    def set_nudges(self, has_nudges: bool) -> None: ...
    def set_workspace(self, scale: float, turn_rad: float = 0) -> None: ...
    def request_pose(self, request: int, number: int = 0, name: str = "", tag: int = 0) -> None: ...
