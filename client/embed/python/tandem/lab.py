"""Reads results of the laboratory and recordings as numpy arrays. It needs python3-h5py.

    study = tandem.lab.read_study("out/squeeze")            # tandem-lab run squeeze --out out/squeeze
    plt.plot(study["rtt_ms"], study["drag_n"], "o")         # one value for each trial

    recording = tandem.lab.read_recording("anna.mcap")      # needs the program tandem-replay
    ticks = recording["ticks"]
    plt.plot(ticks["t_s"], ticks["displayed_force_z_n"])

The name of a column contains its unit. A value that is not known is NaN.
"""

import collections.abc
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import weakref
from typing import Any, Dict, Iterator, List, Mapping, Union

import numpy as np

try:
    import h5py
except ImportError as missing:
    raise ImportError("tandem.lab needs the package h5py: apt install python3-h5py") from missing

Path = Union[str, "os.PathLike[str]"]
Table = Dict[str, "np.ndarray[Any, np.dtype[np.float64]]"]  # by the name of the column

# tandem-replay returns this code if a recording is damaged, after it has exported the intact part.
_DAMAGED = 3


def _value(value: Any) -> Any:
    """Returns an attribute as a float or a text. Numpy has texts as bytes."""
    if isinstance(value, bytes):
        return value.decode()
    return float(value) if isinstance(value, (int, float, np.number)) else str(value)


def _fields(group: Any) -> Dict[str, Any]:
    return {name: _value(value) for name, value in group.attrs.items()}


class Tables(Mapping[str, Table]):
    """Tables of numbers. A table is a dictionary of columns, which is read from the file at each access."""

    def __init__(self, file: pathlib.Path, group: str) -> None:
        self._file, self._group = file, group
        with h5py.File(file, "r") as opened:
            self._names = sorted(opened[group]) if group in opened else []

    def __getitem__(self, name: str) -> Table:
        if name not in self._names:
            raise KeyError(f"{self._file} has no table {name!r}, but {', '.join(self._names) or 'none'}")
        with h5py.File(self._file, "r") as opened:
            return {column: np.asarray(data) for column, data in opened[self._group][name].items()}

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


class Trial:
    """One trial of a study."""

    def __init__(self, file: pathlib.Path, name: str, group: Any) -> None:
        #: Conditions, outcome and metrics.
        self.fields = _fields(group)
        #: Values of the experiment that were replaced (`--set`).
        self.overrides: Dict[str, Any] = json.loads(self.fields.pop("overrides", "") or "{}")
        #: Metrics of each user, by the name of the user.
        self.users = {user: _fields(each) for user, each in group["users"].items()} if "users" in group else {}
        #: Series, e.g. samples["1-anna"]["t_s"]; only with `tandem-lab run --samples` or for a single trial.
        self.samples = Tables(file, f"trials/{name}/samples")

    def __getitem__(self, name: str) -> Any:
        return self.fields[name]


class Study(collections.abc.Sequence):  # type: ignore[type-arg]
    """The trials of a study. A text as index gives a column over all trials, a number one trial."""

    def __init__(self, trials: List[Trial]) -> None:
        self._trials = trials

    def names(self) -> List[str]:
        """Returns the names of the columns."""
        return sorted({name for trial in self._trials for name in trial.fields})

    def __getitem__(self, index: Any) -> Any:
        if not isinstance(index, str):
            return self._trials[index]
        values = [trial.fields.get(index, np.nan) for trial in self._trials]
        if all(index not in trial.fields for trial in self._trials):
            raise KeyError(f"no trial has {index!r}; there are {', '.join(self.names())}")
        return np.array(values, dtype=object if any(isinstance(each, str) for each in values) else np.float64)

    def __len__(self) -> int:
        return len(self._trials)


class Recording(Tables):
    """Tables of a recording: `steps`, `inputs`, `bodies` and `tools` of a room, or `ticks` and `link` of a client."""

    def __init__(self, file: pathlib.Path, is_damaged: bool = False) -> None:
        super().__init__(file, "/")
        with h5py.File(file, "r") as opened:
            about = _fields(opened)
        #: Facts about the recording, as `tandem-replay info --json` prints them.
        self.facts: Dict[str, Any] = json.loads(about.get("facts", "") or "{}")
        #: True if the end of the file is missing, e.g. because its program was killed.
        self.is_damaged = is_damaged


def _file_in(path: Path, name: str, remedy: str) -> pathlib.Path:
    found = pathlib.Path(path)
    found = found / name if found.is_dir() else found
    if not found.exists():
        raise FileNotFoundError(f"{found} does not exist; {remedy}")
    return found


def read_study(path: Path) -> Study:
    """Reads the results of `tandem-lab run` or `live`.

    path: the folder of `--out`, or the file results.h5 in it
    """
    file = _file_in(path, "results.h5", "give the folder of tandem-lab run --out")
    with h5py.File(file, "r") as opened:
        if "trials" not in opened:
            raise ValueError(f"{file} has no trials; a recording is read by read_recording()")
        return Study([Trial(file, name, opened["trials"][name]) for name in sorted(opened["trials"], key=int)])


def _replay_program() -> str:
    """Returns the program of this installation, or else the one in PATH."""
    folders = pathlib.Path(__file__).resolve().parents
    ours = folders[4] / "bin" / "tandem-replay" if len(folders) > 4 else None
    found = str(ours) if ours is not None and ours.exists() else shutil.which("tandem-replay")
    if found is None:
        raise FileNotFoundError("there is no program tandem-replay, which reads .mcap; apt install tandem-lab")
    return found


def read_recording(path: Path) -> Recording:
    """Reads a recording.

    path: a file .mcap of `tandem-server --record` or `tandem-client --record`; or the folder or the file recording.h5
    of `tandem-replay export`. A file .mcap is exported to a temporary folder, which exists as long as the result.
    """
    file = _file_in(path, "recording.h5", "give a file .mcap, or the folder of tandem-replay export --out")
    if file.suffix != ".mcap":
        return Recording(file)
    folder = tempfile.mkdtemp(prefix="tandem-recording-")
    try:
        done = subprocess.run([_replay_program(), "export", str(file), "--out", folder], capture_output=True, text=True,
                              check=False)
        if done.returncode not in (0, _DAMAGED):
            raise ValueError(done.stderr.strip() or f"tandem-replay cannot read {file}")
        recording = Recording(pathlib.Path(folder) / "recording.h5", done.returncode == _DAMAGED)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    weakref.finalize(recording, shutil.rmtree, folder, ignore_errors=True)
    return recording
