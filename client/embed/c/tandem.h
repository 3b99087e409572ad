/* C interface of libtandem, with which a program joins a shared haptic room.
 *
 *   tandem_client_settings settings = {0};
 *   tandem_client client = 0;
 *   settings.struct_size = sizeof settings;
 *   settings.server = "127.0.0.1:47800";
 *   settings.is_insecure = 1;
 *   tandem_client_open(&settings, &client);       opens the device
 *   tandem_client_join(client);                   connects in the background
 *   tandem_client_wait_joined(client, 20.0);
 *   tandem_client_start(client);                  starts the 1 kHz loop on a thread of the library
 *   ...                                           read snapshots, ticks and events, send commands, from any thread
 *   tandem_client_close(client);                  ramps the force to zero, leaves the room
 *
 * Rules for all functions:
 *  - They may be called from any thread. They never throw, and never end the program.
 *  - They return a status. A negative status is an error; tandem_last_error() describes the last one of the thread.
 *  - Handles are numbers that are never reused. A call with a closed handle, or with a handle of another kind, returns
 *    TANDEM_BAD_HANDLE.
 *  - Each struct begins with struct_size, which the caller sets to sizeof the struct. Header and library may have
 *    different versions. If the header is older, settings that it lacks have their defaults. If the header is newer,
 *    settings that the library lacks must be zero, otherwise the call fails with TANDEM_BAD_ARGUMENT; results that the
 *    library lacks are set to zero.
 *  - In settings, zero selects the default, which the comment states in brackets.
 *  - In arrays of structs, struct_size of the first element is the size of each element.
 *
 * A child process of fork() must not use the handles of its parent.
 *
 * Units are SI. Frames: W is the world, D the base of the device. The scene defines the pose of D in the world; in the
 * installed scenes their axes are parallel, and z is up. Rotations are unit quaternions in the order w, x, y, z. A
 * force "on the hand" acts on the user.
 */
#ifndef TANDEM_H
#define TANDEM_H

#include <stddef.h>
#include <stdint.h>

#ifndef TANDEM_API
#if defined(__GNUC__)
#define TANDEM_API __attribute__((visibility("default")))
#else
#define TANDEM_API
#endif
#endif

#ifdef __cplusplus
#define TANDEM_NOEXCEPT noexcept
extern "C" {
#else
#define TANDEM_NOEXCEPT
#endif

/* Status of a call. */
typedef int32_t tandem_status;
enum {
  TANDEM_OK = 0,
  TANDEM_EMPTY = 1,         /* there is nothing to read at present */
  TANDEM_BAD_HANDLE = -1,   /* the handle is closed, or does not belong to an object of this kind */
  TANDEM_BAD_ARGUMENT = -2, /* a null pointer, a bad struct_size, or a value outside its range */
  TANDEM_BAD_STATE = -3,    /* the call is not possible now, e.g. a command before tandem_client_join() */
  TANDEM_SETUP_FAILED = -4, /* a device or a socket cannot be opened */
  TANDEM_ENDED = -5,        /* the session has ended, or the server has refused it */
  TANDEM_TIMED_OUT = -6,
  TANDEM_LIMIT = -7,     /* too many open handles */
  TANDEM_NO_MEMORY = -8, /* also: no threads or descriptors are left */
  TANDEM_FAULT = -9      /* an error of the library */
};

/* Returns the meaning of a status in English. The text is constant. */
TANDEM_API const char* tandem_status_text(tandem_status status) TANDEM_NOEXCEPT;
/* Returns the description of the last error of the calling thread, with the value and the remedy; "" if there was none.
 * The text is valid until the next call of this thread. */
TANDEM_API const char* tandem_last_error(void) TANDEM_NOEXCEPT;
/* Returns the version of the library, such as "0.1.0". */
TANDEM_API const char* tandem_version(void) TANDEM_NOEXCEPT;
/* Returns the version of the network protocol. A server with another version refuses the join with a message. */
TANDEM_API uint32_t tandem_protocol_version(void) TANDEM_NOEXCEPT;

/* Structs that are parts of other structs. Their size never changes, so they have no struct_size. */
typedef struct tandem_pose {
  double position_m[3];
  double rotation_wxyz[4];
} tandem_pose;
typedef struct tandem_twist {
  double linear_m_per_s[3];
  double angular_rad_per_s[3];
} tandem_twist;
typedef struct tandem_wrench {
  double force_n[3];
  double torque_n_m[3];
} tandem_wrench;

/* A haptic device that the calling program drives itself.
 *
 * The program passes samples to the library and reads force commands, 200 to 2000 times a second, from its own threads.
 * If samples stop, the force begins to decrease after 10 ms and is zero 20 ms after the last sample. When samples
 * continue, the force returns with a ramp of 0.5 s. The force is also zero while no client uses the device, and if the
 * loop of the library is 20 ms late. */

typedef uint64_t tandem_device; /* 0 is no device */

enum { TANDEM_BUTTON_GRAB = 1, TANDEM_BUTTON_CLUTCH = 2 };

enum {
  TANDEM_SENSES_ROTATION = 1,   /* without it, the orientation of the handle is constant */
  TANDEM_DISPLAYS_TORQUE = 2,   /* without it, no torque is commanded */
  TANDEM_DISPLAYS_NO_FORCE = 4, /* a device for input only */
};

typedef struct tandem_device_settings {
  uint32_t struct_size;
  uint32_t abilities;               /* TANDEM_SENSES_ROTATION, ... */
  const char* name;                 /* ["program"] */
  double force_limit_n;             /* commands are limited to this magnitude [2] */
  double torque_limit_n_m;          /* [0.1] */
  double force_maximum_n;           /* maximum of the hardware; needed for a force limit above 2 N */
  double torque_maximum_n_m;        /* maximum of the hardware; needed for a torque limit above 0.1 N*m */
  const char* maximum_source;       /* source of the two maxima: a data sheet or a measurement */
  double workspace_m[3];            /* size of the reachable space, centred at the origin of D [unknown] */
  double reach_m;                   /* a sample farther from the origin is a fault [2] */
  double speed_limit_m_per_s;       /* a faster handle sets the force to zero [3] */
  double slew_limit_n_per_s;        /* maximum rate of change of the force [4000] */
  double slew_limit_n_m_per_s;      /* the same for the torque [200] */
  double position_step_m;           /* resolution of the fed positions [exact] */
  double rotation_step_rad;         /* resolution of the fed rotations [exact] */
  double stiffness_maximum_n_per_m; /* largest stable stiffness of the device, from maximum_source [unknown] */
  double damping_maximum_n_s_per_m; /* largest stable damping of the device [unknown] */
} tandem_device_settings;

typedef struct tandem_sample {
  uint32_t struct_size;
  uint32_t buttons;      /* TANDEM_BUTTON_... */
  uint32_t has_velocity; /* 0: the library estimates the velocity */
  uint32_t reserved;     /* must be 0 */
  tandem_pose handle_D;  /* a rotation of four zeros means no rotation */
  tandem_twist velocity_D;
} tandem_sample;

typedef struct tandem_force {
  uint32_t struct_size;
  uint32_t
      is_stale; /* 1: the newest sample or command is older than 20 ms, or there is none; the command is then zero */
  tandem_wrench on_hand_D; /* command for the motors, limited; the torque is about the origin of the handle */
  uint64_t commands;       /* number of commands so far; unchanged if there was no new one */
} tandem_force;

TANDEM_API tandem_status tandem_device_open(const tandem_device_settings* settings,
                                            tandem_device* device) TANDEM_NOEXCEPT;
/* Passes the newest sample to the library. A sample is refused if a value is not finite, or if the rotation is not a
* unit quaternion. */
TANDEM_API tandem_status tandem_device_feed(tandem_device device, const tandem_sample* sample) TANDEM_NOEXCEPT;
/* Reads the current force command. It never waits for a new one. */
TANDEM_API tandem_status tandem_device_force(tandem_device device, tandem_force* force) TANDEM_NOEXCEPT;
/* Closes the device. A client that still uses it displays no force from then on. */
TANDEM_API tandem_status tandem_device_close(tandem_device device) TANDEM_NOEXCEPT;

/* A client, which can join a room and has a device. 0 is no client. */
typedef uint64_t tandem_client;

/* Roles. In the settings, 0 selects the role that the token grants, or TANDEM_MANIPULATOR without a token. */
enum { TANDEM_MANIPULATOR = 1, TANDEM_OBSERVER = 2, TANDEM_OPERATOR = 3 };

/* Settings of a client. Texts are copied. Trust in the server requires exactly one of these: an invitation; a pin and a
* token; authorities and a token; is_insecure. */
typedef struct tandem_client_settings {
  uint32_t struct_size;
  uint32_t role;               /* TANDEM_MANIPULATOR, ... */
  const char* server;          /* "HOST:PORT"; unused with an invitation ["127.0.0.1:47800"] */
  const char* room;            /* [the server's only room] */
  const char* user_name;       /* ["user"] */
  const char* invitation;      /* as tandem-server --invite prints it */
  const char* pin;             /* public key of the server, as the server prints it at its start */
  const char* authorities;     /* file with the certificates of the accepted authorities */
  const char* token;           /* as tandem-token prints it */
  uint32_t is_insecure;        /* 1: neither TLS nor authentication, for a server on this machine only */
  uint32_t uses_tcp;           /* 1: state updates are sent over TCP, for networks that block UDP */
  tandem_device own_device;    /* device that the program drives; 0: the library opens `device` */
  const char* device;          /* "sim", "falcon", ...; "auto": the first real device that is connected ["sim"] */
  const char* profile;         /* profile of the device, by name or file [that of the device] */
  const char* hand;            /* path of a simulated hand, by name or file ["rest"] */
  const char* stage;           /* ["local-model"] */
  const char* predictor;       /* ["scored"] */
  uint32_t has_no_passivity;   /* 1: without passivity controller */
  int32_t realtime_priority;   /* SCHED_FIFO priority of the haptic thread, 1 to 99; -1: normal scheduler [70]. A
                                   priority also locks the memory of the process */
  uint32_t has_simulated_link; /* 1: tandem_client_set_link() may be used */
  uint32_t has_no_cache;       /* 1: fetched assets are not stored in the cache of the user */
  const char* firmware;        /* falcon: firmware file of its manufacturer [the device has it already] */
  double motor_counts_per_n_m; /* falcon: motor command for 1 N*m [3000] */
  const char* library;         /* file of a vendor's SDK [searched in the system's library path] */
  const char* service;         /* inverse3: "HOST:PORT" of the manufacturer's service ["127.0.0.1:10001"] */
  const char* motors;          /* sim: file to which its commands are also written, for tests of the watchdog [none] */
} tandem_client_settings;

/* State of a session. */
enum {
  TANDEM_NOT_STARTED = 0,
  TANDEM_CONNECTING = 1, /* also during the handshake, and until the next attempt to connect */
  TANDEM_JOINED = 2,
  TANDEM_SESSION_ENDED = 3
};

typedef struct tandem_session {
  uint32_t struct_size;
  uint32_t state;      /* TANDEM_JOINED, ... */
  uint32_t user;       /* id of this user; 0 before the first join */
  uint32_t role;       /* TANDEM_MANIPULATOR, ... */
  uint32_t is_running; /* 1: the 1 kHz loop runs */
  uint32_t reconnects;
  uint64_t lost_ticks;  /* ticks that were not read in time */
  double round_trip_s;  /* 0: not known */
  char room[72];        /* texts end with 0; longer ones are cut */
  char law[40];         /* coupling law of the room */
  char stage[40];       /* stage that was selected last */
  char reason[512];     /* reason why the session is not joined */
  char note[512];       /* how the scene is displayed, and refused real-time rights */
  uint64_t lost_events; /* events that were not read in time */
  char device[72];      /* name of the device */
} tandem_session;

/* Reasons why the displayed force differs from the computed one: bits of tandem_tick.safety. */
enum {
  TANDEM_SAFETY_RAMPING = 1,          /* start ramp */
  TANDEM_SAFETY_SILENCE = 2,          /* the server has sent no state for too long */
  TANDEM_SAFETY_SLEWED = 4,           /* the rate of change was limited */
  TANDEM_SAFETY_NOT_FINITE = 8,       /* the computed force was not finite */
  TANDEM_SAFETY_TOO_FAST = 16,        /* the handle was faster than its speed limit */
  TANDEM_SAFETY_BAD_SAMPLE = 32,      /* the pose is unknown: the device is lost, or samples have stopped */
  TANDEM_SAFETY_STOPPING = 64,        /* the client is being stopped */
  TANDEM_SAFETY_NOT_DISPLAYING = 128, /* not joined, an observer, or a coupling that this device cannot render stably */
  TANDEM_SAFETY_CLUTCHED = 256,
  TANDEM_SAFETY_LATE = 512, /* a tick was late */
  TANDEM_SAFETY_SLOW = 1024 /* the loop or the server is below 90 % of its rate */
};

/* One tick of the 1 kHz loop. */
typedef struct tandem_tick {
  uint32_t struct_size;
  uint32_t safety;          /* TANDEM_SAFETY_... */
  uint64_t number;          /* number of the tick, from 1 */
  int64_t time_ns;          /* clock of the library (CLOCK_BOOTTIME on Linux) */
  uint64_t server_step;     /* number of the newest step of the server; 0: none */
  double state_age_s;       /* age of the newest state of the server; negative: none was received */
  uint32_t buttons;         /* TANDEM_BUTTON_... */
  uint32_t held_body;       /* 0: none */
  uint32_t is_sample_valid; /* 0: the pose of the handle is unknown */
  uint32_t is_local;        /* 1: `tool_W` is from the local model; 0: from the server */
  tandem_pose device_D;     /* pose of the handle as the device measures it */
  tandem_pose handle_W;     /* pose of the handle in the world */
  tandem_twist handle_velocity_W;
  tandem_pose tool_W;
  tandem_twist tool_velocity_W;
  tandem_wrench on_hand_D; /* the last force and torque that the device has accepted */
} tandem_tick;

/* Newest state of the room. */
typedef struct tandem_snapshot {
  uint32_t struct_size;
  uint32_t has_state;     /* 0: no state of the server was received yet in this room */
  uint64_t step;          /* number of the server's step */
  uint32_t server_faults; /* bits of tandem_server_fault_text() */
  uint32_t body_count;    /* number of bodies of tandem_client_bodies() */
  uint32_t user_count;    /* number of users of tandem_client_users() */
  uint32_t reserved;
  double field_energy_kj_per_mol; /* energy of the molecular field; 0 if there is none */
} tandem_snapshot;

typedef struct tandem_body {
  uint32_t struct_size;
  uint32_t id;      /* from 1, in the order of the scene */
  uint32_t held_by; /* id of a user; 0: nobody */
  uint32_t reserved;
  tandem_pose pose_W;
  tandem_twist velocity_W;
  char name[72];
} tandem_body;

typedef struct tandem_user {
  uint32_t struct_size;
  uint32_t id;
  uint32_t role;
  uint32_t holds; /* id of a body; 0: none */
  tandem_pose tool_W;
  char name[72];
} tandem_user;

enum {
  TANDEM_EVENT_STATE = 1,          /* code: state of the session; text: reason */
  TANDEM_EVENT_JOINED = 2,         /* user: id of this user; text: scene */
  TANDEM_EVENT_USER_JOINED = 3,    /* user: id; code: role; text: name */
  TANDEM_EVENT_USER_LEFT = 4,      /* user: id */
  TANDEM_EVENT_GRABBED = 5,        /* body: this user's tool has grabbed it */
  TANDEM_EVENT_RELEASED = 6,       /* body: this user's tool has released it */
  TANDEM_EVENT_PARAMETER_SET = 7,  /* text: name; value: new value */
  TANDEM_EVENT_LAW_SET = 8,        /* text: law */
  TANDEM_EVENT_REFUSED = 9,        /* the server has refused a command; text: reason */
  TANDEM_EVENT_POSE_ANSWERED = 10, /* tag of the request; code: 1 done, 0 refused; text: result */
  TANDEM_EVENT_NEWS = 11,          /* text: a change in the room, for the user */
  TANDEM_EVENT_LOG = 12            /* text: a line for a log */
};

typedef struct tandem_event {
  uint32_t struct_size;
  uint32_t kind; /* TANDEM_EVENT_...; programs must ignore unknown kinds, which later versions may add */
  uint32_t user;
  uint32_t body;
  uint32_t code;
  uint32_t tag;
  double value;
  uint32_t text_bytes; /* length of the complete text without the 0 at its end, even if the text was cut */
  uint32_t reserved;
} tandem_event;

/* Opens a client and its device, but does not connect. Opening a device may take a second. */
TANDEM_API tandem_status tandem_client_open(const tandem_client_settings* settings,
                                            tandem_client* client) TANDEM_NOEXCEPT;
/* Starts to join the room and returns at once. After a lost connection, the client rejoins automatically for up to 15
* minutes. */
TANDEM_API tandem_status tandem_client_join(tandem_client client) TANDEM_NOEXCEPT;
/* Waits until the room is joined. TANDEM_ENDED: the server has refused the client; the last error states the reason. */
TANDEM_API tandem_status tandem_client_wait_joined(tandem_client client, double timeout_s) TANDEM_NOEXCEPT;
/* Starts the 1 kHz loop; tandem_client_join() must come first. A simulated hand starts its path at this call. */
TANDEM_API tandem_status tandem_client_start(tandem_client client) TANDEM_NOEXCEPT;
/* Ramps the force to zero within 50 ms, then leaves the room within 0.5 s. Unread ticks, events and the last snapshot
* can still be read afterwards. */
TANDEM_API tandem_status tandem_client_stop(tandem_client client) TANDEM_NOEXCEPT;
/* Stops the client and closes the handle. All clients are closed automatically when the program exits. */
TANDEM_API tandem_status tandem_client_close(tandem_client client) TANDEM_NOEXCEPT;

TANDEM_API tandem_status tandem_client_session(tandem_client client, tandem_session* session) TANDEM_NOEXCEPT;

/* Reads the newest state of the room and the tick in which the loop published it, at most 4 ms ago while the loop runs.
* Either pointer may be null. The haptic thread never waits for a reader. TANDEM_EMPTY: the loop has not ticked yet. */
TANDEM_API tandem_status tandem_client_snapshot(tandem_client client, tandem_snapshot* snapshot,
                                                tandem_tick* tick) TANDEM_NOEXCEPT;
/* Read the bodies or the users of the newest state. `count` is set to the number of written elements, at most
* `capacity`. */
TANDEM_API tandem_status tandem_client_bodies(tandem_client client, tandem_body* bodies, uint32_t capacity,
                                              uint32_t* count) TANDEM_NOEXCEPT;
TANDEM_API tandem_status tandem_client_users(tandem_client client, tandem_user* users, uint32_t capacity,
                                             uint32_t* count) TANDEM_NOEXCEPT;
/* Returns the names of the bits of tandem_snapshot.server_faults, such as "overrun|input_stale"; "none" for 0. The text
 * is valid until the next call of this thread. */
TANDEM_API const char* tandem_server_fault_text(uint32_t faults) TANDEM_NOEXCEPT;

/* Reads and removes the oldest unread ticks. The library keeps the unread ticks of 4 s; beyond that, new ticks are
* discarded and counted in lost_ticks. TANDEM_EMPTY: there is no unread tick. */
TANDEM_API tandem_status tandem_client_read_ticks(tandem_client client, tandem_tick* ticks, uint32_t capacity,
                                                  uint32_t* count) TANDEM_NOEXCEPT;

/* Reads and removes the oldest event. Its text is cut to `text_size` bytes, including the 0 at its end. At most 4096
* events are kept; beyond that, the oldest ones are discarded. TANDEM_EMPTY: there is no event. */
TANDEM_API tandem_status tandem_client_next_event(tandem_client client, tandem_event* event, char* text,
                                                  size_t text_size) TANDEM_NOEXCEPT;
/* Waits for an event. TANDEM_TIMED_OUT: none has arrived. */
TANDEM_API tandem_status tandem_client_wait_event(tandem_client client, double timeout_s) TANDEM_NOEXCEPT;
/* Returns a file descriptor that is readable while there are events, for poll() and event loops. It belongs to the
* library: do not read from it or close it. It is valid until tandem_client_close(). */
TANDEM_API tandem_status tandem_client_event_descriptor(tandem_client client, int* descriptor) TANDEM_NOEXCEPT;

/* Commands. They return at once. Events and snapshots show their effect later. */

/* Grabs a body; 0: the nearest one within reach. */
TANDEM_API tandem_status tandem_client_grab(tandem_client client, uint32_t body) TANDEM_NOEXCEPT;
TANDEM_API tandem_status tandem_client_release(tandem_client client) TANDEM_NOEXCEPT;
/* Shows a position in the world to the other users. If `body` is not 0, the position moves with that body. */
TANDEM_API tandem_status tandem_client_point(tandem_client client, uint32_t body,
                                             const double place_W_m[3]) TANDEM_NOEXCEPT;
/* Sets a coefficient of the room's coupling, such as "coupling.stiffness_n_per_m"; operator only. */
TANDEM_API tandem_status tandem_client_set_parameter(tandem_client client, const char* name,
                                                     double value) TANDEM_NOEXCEPT;
/* Sets the coupling law of the room; operator only. */
TANDEM_API tandem_status tandem_client_set_law(tandem_client client, const char* law) TANDEM_NOEXCEPT;
/* Selects how the force is computed. The force changes to the new value gradually. Null for `predictor` keeps the
* current one. */
TANDEM_API tandem_status tandem_client_set_stage(tandem_client client, const char* stage, const char* predictor,
                                                 uint32_t has_passivity) TANDEM_NOEXCEPT;
/* Sets delay, jitter and loss of the simulated link in both directions; requires has_simulated_link. `loss` is the
* fraction of lost messages, 0 to 0.95. */
TANDEM_API tandem_status tandem_client_set_link(tandem_client client, double delay_s, double jitter_s,
                                                double loss) TANDEM_NOEXCEPT;
/* Moves all bodies to their start poses; operator only. */
TANDEM_API tandem_status tandem_client_reset_room(tandem_client client) TANDEM_NOEXCEPT;
/* Leaves the room and joins another room of the same server. */
TANDEM_API tandem_status tandem_client_change_room(tandem_client client, const char* room) TANDEM_NOEXCEPT;
/* Switches nudges on (1) or off (0): short pulls of the hand towards positions that other users show. */
TANDEM_API tandem_status tandem_client_set_nudges(tandem_client client, uint32_t has_nudges) TANDEM_NOEXCEPT;
/* Changes the mapping from hand motion to tool motion. `scale` is a factor for the scene's ratio of tool motion to hand
* motion, 0.1 to 10. `turn_rad` is a rotation about the vertical axis [rad]. */
TANDEM_API tandem_status tandem_client_set_workspace(tandem_client client, double scale,
                                                     double turn_rad) TANDEM_NOEXCEPT;

enum {
  TANDEM_POSE_KEEP = 0, /* stores the current pose; name may be null */
  TANDEM_POSE_GO_TO = 1,
  TANDEM_POSE_UNDO = 2,
  TANDEM_POSE_REDO = 3,
  TANDEM_POSE_MINIMISE = 4,
  TANDEM_POSE_DELETE = 5,
  TANDEM_POSE_RENAME = 6,
  TANDEM_POSE_CANCEL = 7
};
/* Requests an operation on the relative pose of the room's two molecules. If `tag` is not 0, an event
* TANDEM_EVENT_POSE_ANSWERED with this tag reports the result. */
TANDEM_API tandem_status tandem_client_request_pose(tandem_client client, uint32_t request, uint32_t number,
                                                    const char* name, uint32_t tag) TANDEM_NOEXCEPT;

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* TANDEM_H */
