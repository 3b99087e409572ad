// libtandem for C#: one file, for Unity, Mono and .NET. It needs no other assembly and no unsafe code.
//
//   using (var client = new Tandem.Client(new Tandem.ClientSettings { IsInsecure = true })) {
//     client.Join();
//     client.WaitJoined(20);
//     client.Start();
//     while (...) { Tandem.Tick tick; client.Snapshot(out tick); ... }
//   }
//
// Dispose() ramps the force to zero and leaves the room. A thread of the library displays the force, so the garbage
// collector never delays it. All methods may be called from any thread. tandem.h describes units, frames and safety.
// The fields of the structs have the same names as in tandem.h, where they are described.
using System;
using System.Runtime.InteropServices;
using System.Text;

namespace Tandem {

/// Exception for a failed call, for example a parameter out of range or a refused join. Message names the value and the
/// remedy.
public sealed class TandemException : Exception {
  public readonly Status Status;
  public TandemException(Status status, string text) : base(text) { Status = status; }
}

public enum Status {
  Ok = 0, Empty = 1, BadHandle = -1, BadArgument = -2, BadState = -3, SetupFailed = -4, Ended = -5, TimedOut = -6,
  Limit = -7, NoMemory = -8, Fault = -9
}
public enum Role : uint { FromToken = 0, Manipulator = 1, Observer = 2, Operator = 3 }
public enum SessionState : uint { NotStarted = 0, Connecting = 1, Joined = 2, Ended = 3 }
[Flags] public enum Buttons : uint { None = 0, Grab = 1, Clutch = 2 }
[Flags] public enum Abilities : uint { None = 0, SensesRotation = 1, DisplaysTorque = 2, DisplaysNoForce = 4 }
[Flags] public enum Safety : uint {
  None = 0, Ramping = 1, Silence = 2, Slewed = 4, NotFinite = 8, TooFast = 16, BadSample = 32, Stopping = 64,
  NotDisplaying = 128, Clutched = 256, Late = 512, Slow = 1024
}
/// Kinds of events. A program must ignore kinds that are not in this list.
public enum EventKind : uint {
  State = 1, Joined = 2, UserJoined = 3, UserLeft = 4, Grabbed = 5, Released = 6, ParameterSet = 7, LawSet = 8,
  Refused = 9, PoseAnswered = 10, News = 11, Log = 12
}
public enum PoseRequest : uint {
  Keep = 0, GoTo = 1, Undo = 2, Redo = 3, Minimise = 4, Delete = 5, Rename = 6, Cancel = 7
}

[StructLayout(LayoutKind.Sequential)] public struct Vector { public double x, y, z; }
[StructLayout(LayoutKind.Sequential)] public struct Rotation { public double w, x, y, z; }
[StructLayout(LayoutKind.Sequential)] public struct Pose { public Vector position_m; public Rotation rotation_wxyz; }
[StructLayout(LayoutKind.Sequential)] public struct Twist { public Vector linear_m_per_s, angular_rad_per_s; }
[StructLayout(LayoutKind.Sequential)] public struct Wrench { public Vector force_n, torque_n_m; }

/// A text in UTF-8, in a buffer of 72 bytes. It is a value type, so that an array of bodies is a single block of
/// memory.
[StructLayout(LayoutKind.Sequential)]
public struct Name {
  ulong a, b, c, d, e, f, g, h, i;
  public override string ToString() {
    var bytes = new byte[72];
    var words = new[] { a, b, c, d, e, f, g, h, i };
    for (int n = 0; n < words.Length; ++n) BitConverter.GetBytes(words[n]).CopyTo(bytes, 8 * n);
    return Native.TextOf(bytes);
  }
}

/// tandem_sample: the pose of the handle of a device of the program.
[StructLayout(LayoutKind.Sequential)]
public struct Sample {
  internal uint struct_size;
  public Buttons buttons;
  public uint has_velocity;
  uint reserved;
  public Pose handle_D;
  public Twist velocity_D;
}

/// tandem_force: the command for the motors of a device of the program.
[StructLayout(LayoutKind.Sequential)]
public struct Force {
  internal uint struct_size;
  public uint is_stale;
  public Wrench on_hand_D;
  public ulong commands;
}

/// tandem_tick: one tick of the 1 kHz loop.
[StructLayout(LayoutKind.Sequential)]
public struct Tick {
  internal uint struct_size;
  public Safety safety;
  public ulong number;
  public long time_ns;
  public ulong server_step;
  public double state_age_s;
  public Buttons buttons;
  public uint held_body, is_sample_valid, is_local;
  public Pose device_D, handle_W;
  public Twist handle_velocity_W;
  public Pose tool_W;
  public Twist tool_velocity_W;
  public Wrench on_hand_D;
}

/// tandem_snapshot: the newest state of the room.
[StructLayout(LayoutKind.Sequential)]
public struct Room {
  internal uint struct_size;
  public uint has_state;
  public ulong step;
  public uint server_faults, body_count, user_count;
  uint reserved;
  public double field_energy_kj_per_mol;
}

/// tandem_body: a body of the newest state.
[StructLayout(LayoutKind.Sequential)]
public struct Body {
  internal uint struct_size;
  public uint id, held_by;
  uint reserved;
  public Pose pose_W;
  public Twist velocity_W;
  public Name name;
}

/// tandem_user: another user in the newest state.
[StructLayout(LayoutKind.Sequential)]
public struct User {
  internal uint struct_size;
  public uint id;
  public Role role;
  public uint holds;
  public Pose tool_W;
  public Name name;
}

/// tandem_session: the state of the session.
public sealed class Session {
  public SessionState State;
  public uint User, Reconnects;
  public Role Role;
  public bool IsRunning;
  public ulong LostTicks, LostEvents;
  public double RoundTripS;
  public string Room, Law, Stage, Reason, Note, Device;
}

/// tandem_event: an event, with its text.
public sealed class Event {
  public EventKind Kind;
  public uint User, Body, Code, Tag;
  public double Value;
  public string Text;
}

/// Limits of a device of the program; a zero or null selects the default that tandem.h states.
public sealed class DeviceSettings {
  public Abilities Abilities;
  public string Name, MaximumSource;
  public double ForceLimitN, TorqueLimitNm, ForceMaximumN, TorqueMaximumNm;
  public Vector WorkspaceM;
  public double ReachM, SpeedLimitMPerS, SlewLimitNPerS, SlewLimitNmPerS, PositionStepM, RotationStepRad;
  public double StiffnessMaximumNPerM, DampingMaximumNsPerM;
}

/// A device that the program drives: Feed() and ReadForce() are called 200 to 2000 times a second, on a thread of the
/// program. If the feed stalls, e.g. during a garbage collection, the force is zero 20 ms later and returns by a ramp.
public sealed class OwnDevice : IDisposable {
  public OwnDevice(DeviceSettings settings = null) {
    settings = settings ?? new DeviceSettings();
    using (var texts = new Texts()) {
      var native = new Native.DeviceSettings {
        struct_size = Native.SizeOf<Native.DeviceSettings>(),
        abilities = settings.Abilities,
        name = texts.Add(settings.Name),
        force_limit_n = settings.ForceLimitN,
        torque_limit_n_m = settings.TorqueLimitNm,
        force_maximum_n = settings.ForceMaximumN,
        torque_maximum_n_m = settings.TorqueMaximumNm,
        maximum_source = texts.Add(settings.MaximumSource),
        workspace_m = settings.WorkspaceM,
        reach_m = settings.ReachM,
        speed_limit_m_per_s = settings.SpeedLimitMPerS,
        slew_limit_n_per_s = settings.SlewLimitNPerS,
        slew_limit_n_m_per_s = settings.SlewLimitNmPerS,
        position_step_m = settings.PositionStepM,
        rotation_step_rad = settings.RotationStepRad,
        stiffness_maximum_n_per_m = settings.StiffnessMaximumNPerM,
        damping_maximum_n_s_per_m = settings.DampingMaximumNsPerM,
      };
      ulong handle;
      Checked(Native.tandem_device_open(ref native, out handle));
      Handle = handle;
    }
  }
  // The finalizer also runs if the constructor failed, e.g. because the library is missing. In that case there is
  // nothing to close. A call of the missing library would throw, and an exception of a finalizer would end the program.
  ~OwnDevice() {
    if (Handle != 0) Native.tandem_device_close(Handle);
  }
  public void Dispose() {
    Native.tandem_device_close(Handle);
    GC.SuppressFinalize(this);
  }

  public void Feed(Sample sample) {
    sample.struct_size = Native.SizeOf<Sample>();
    Checked(Native.tandem_device_feed(Handle, ref sample));
  }
  public Force ReadForce() {
    var force = new Force { struct_size = Native.SizeOf<Force>() };
    Checked(Native.tandem_device_force(Handle, ref force));
    return force;
  }

  /// Checks a status like Native.Check(). Keeps this object alive until the native call has ended, because the object's
  /// finalizer closes the device.
  Status Checked(Status status) {
    GC.KeepAlive(this);
    return Native.Check(status);
  }

  internal readonly ulong Handle;
}

/// Settings of a client; a zero, null or false selects the default that tandem.h states.
public sealed class ClientSettings {
  public string Server, Room, UserName, Invitation, Pin, Authorities, Token;
  public bool IsInsecure, UsesTcp;
  public Role Role;
  public OwnDevice OwnDevice;
  public string Device, Profile, Hand, Stage, Predictor;
  public bool HasPassivity = true, HasSimulatedLink, HasCache = true;
  public int RealtimePriority;
  public string Firmware, Library, Service, Motors;
  public double MotorCountsPerNm;
}

/// A client of a room, with its device.
public sealed class Client : IDisposable {
  public Client(ClientSettings settings) {
    device_ = settings.OwnDevice;
    using (var texts = new Texts()) {
      var native = new Native.ClientSettings {
        struct_size = Native.SizeOf<Native.ClientSettings>(),
        role = settings.Role,
        server = texts.Add(settings.Server),
        room = texts.Add(settings.Room),
        user_name = texts.Add(settings.UserName),
        invitation = texts.Add(settings.Invitation),
        pin = texts.Add(settings.Pin),
        authorities = texts.Add(settings.Authorities),
        token = texts.Add(settings.Token),
        is_insecure = settings.IsInsecure ? 1u : 0u,
        uses_tcp = settings.UsesTcp ? 1u : 0u,
        own_device = device_ == null ? 0 : device_.Handle,
        device = texts.Add(settings.Device),
        profile = texts.Add(settings.Profile),
        hand = texts.Add(settings.Hand),
        stage = texts.Add(settings.Stage),
        predictor = texts.Add(settings.Predictor),
        has_no_passivity = settings.HasPassivity ? 0u : 1u,
        realtime_priority = settings.RealtimePriority,
        has_simulated_link = settings.HasSimulatedLink ? 1u : 0u,
        has_no_cache = settings.HasCache ? 0u : 1u,
        firmware = texts.Add(settings.Firmware),
        motor_counts_per_n_m = settings.MotorCountsPerNm,
        library = texts.Add(settings.Library),
        service = texts.Add(settings.Service),
        motors = texts.Add(settings.Motors),
      };
      Checked(Native.tandem_client_open(ref native, out handle_));
    }
  }
  // See ~OwnDevice().
  ~Client() {
    if (handle_ != 0) Native.tandem_client_close(handle_);
  }
  public void Dispose() {
    Native.tandem_client_close(handle_);
    GC.SuppressFinalize(this);
  }

  public void Join() { Checked(Native.tandem_client_join(handle_)); }
  public void WaitJoined(double timeoutS = 20) { Checked(Native.tandem_client_wait_joined(handle_, timeoutS)); }
  public void Start() { Checked(Native.tandem_client_start(handle_)); }
  /// Ramps the force to zero and leaves the room. Ticks and events can still be read.
  public void Stop() { Checked(Native.tandem_client_stop(handle_)); }

  public Session ReadSession() {
    var native = new Native.Session { struct_size = Native.SizeOf<Native.Session>() };
    Checked(Native.tandem_client_session(handle_, ref native));
    return new Session {
      State = native.state, User = native.user, Role = native.role, IsRunning = native.is_running != 0,
      Reconnects = native.reconnects, LostTicks = native.lost_ticks, RoundTripS = native.round_trip_s,
      Room = Native.TextOf(native.room), Law = Native.TextOf(native.law), Stage = Native.TextOf(native.stage),
      Reason = Native.TextOf(native.reason), Note = Native.TextOf(native.note), LostEvents = native.lost_events,
      Device = Native.TextOf(native.device),
    };
  }

  /// Reads the newest tick, without a wait or an allocation. Returns false if the loop has not ticked yet.
  public bool Snapshot(out Tick tick) {
    Room room;
    return Snapshot(out room, out tick);
  }
  public bool Snapshot(out Room room, out Tick tick) {
    room = new Room { struct_size = Native.SizeOf<Room>() };
    tick = new Tick { struct_size = Native.SizeOf<Tick>() };
    return Checked(Native.tandem_client_snapshot(handle_, ref room, ref tick)) == Status.Ok;
  }
  /// Reads bodies of the newest state into the caller's array, without an allocation. Returns their number.
  public int ReadBodies(Body[] bodies) {
    if (bodies.Length == 0) return 0;
    bodies[0].struct_size = Native.SizeOf<Body>();
    uint count;
    Checked(Native.tandem_client_bodies(handle_, bodies, (uint)bodies.Length, out count));
    return (int)count;
  }
  /// Reads the other users into the caller's array. Returns their number.
  public int ReadUsers(User[] users) {
    if (users.Length == 0) return 0;
    users[0].struct_size = Native.SizeOf<User>();
    uint count;
    Checked(Native.tandem_client_users(handle_, users, (uint)users.Length, out count));
    return (int)count;
  }
  /// Reads and removes the oldest unread ticks, at most as many as the array can hold. Returns their number.
  public int ReadTicks(Tick[] ticks) {
    if (ticks.Length == 0) return 0;
    ticks[0].struct_size = Native.SizeOf<Tick>();
    uint count;
    Checked(Native.tandem_client_read_ticks(handle_, ticks, (uint)ticks.Length, out count));
    return (int)count;
  }

  /// Reads and removes the oldest event. Returns null if there is no event.
  public Event NextEvent() {
    var native = new Native.Event { struct_size = Native.SizeOf<Native.Event>() };
    var text = text_ ?? (text_ = new byte[4096]);
    var status = Native.tandem_client_next_event(handle_, ref native, text, (UIntPtr)(uint)text.Length);
    if (Checked(status) == Status.Empty) return null;
    return new Event {
      Kind = native.kind, User = native.user, Body = native.body, Code = native.code, Tag = native.tag,
      Value = native.value, Text = Native.TextOf(text),
    };
  }
  /// Waits for an event. Returns false after the time-out.
  public bool WaitEvent(double timeoutS) {
    var status = Native.tandem_client_wait_event(handle_, timeoutS);
    GC.KeepAlive(this);
    if (status == Status.TimedOut) return false;
    Native.Check(status);
    return true;
  }

  /// Grabs a body; 0: the nearest one within reach.
  public void Grab(uint body = 0) { Checked(Native.tandem_client_grab(handle_, body)); }
  public void Release() { Checked(Native.tandem_client_release(handle_)); }
  public void Point(Vector placeW, uint body = 0) {
    Checked(Native.tandem_client_point(handle_, body, ref placeW));
  }
  public void SetParameter(string name, double value) {
    using (var texts = new Texts()) Checked(Native.tandem_client_set_parameter(handle_, texts.Add(name), value));
  }
  public void SetLaw(string law) {
    using (var texts = new Texts()) Checked(Native.tandem_client_set_law(handle_, texts.Add(law)));
  }
  /// Selects how the force is computed. Null for the predictor keeps the current one.
  public void SetStage(string stage, string predictor = null, bool hasPassivity = true) {
    using (var texts = new Texts()) {
      Checked(Native.tandem_client_set_stage(handle_, texts.Add(stage), texts.Add(predictor),
                                             hasPassivity ? 1u : 0u));
    }
  }
  public void SetLink(double delayS, double jitterS = 0, double loss = 0) {
    Checked(Native.tandem_client_set_link(handle_, delayS, jitterS, loss));
  }
  public void ResetRoom() { Checked(Native.tandem_client_reset_room(handle_)); }
  public void ChangeRoom(string room) {
    using (var texts = new Texts()) Checked(Native.tandem_client_change_room(handle_, texts.Add(room)));
  }
  public void SetNudges(bool hasNudges) { Checked(Native.tandem_client_set_nudges(handle_, hasNudges ? 1u : 0u)); }
  public void SetWorkspace(double scale, double turnRad = 0) {
    Checked(Native.tandem_client_set_workspace(handle_, scale, turnRad));
  }
  public void RequestPose(PoseRequest request, uint number = 0, string name = null, uint tag = 0) {
    using (var texts = new Texts()) {
      Checked(Native.tandem_client_request_pose(handle_, request, number, texts.Add(name), tag));
    }
  }

  /// Checks a status like Native.Check(). Keeps this object alive until the native call has ended, because the object's
  /// finalizer closes the client.
  Status Checked(Status status) {
    GC.KeepAlive(this);
    return Native.Check(status);
  }

  [ThreadStatic] static byte[] text_;  // buffer of this thread, so that a query allocates nothing
  readonly ulong handle_;
  readonly OwnDevice device_;  // keeps the device from the garbage collector
}

/// Version of the installed library.
public static class Library {
  public static string Version { get { return Native.TextAt(Native.tandem_version()); } }
  public static uint ProtocolVersion { get { return Native.tandem_protocol_version(); } }
  /// Returns the names of the bits of Room.server_faults.
  public static string ServerFaultText(uint faults) { return Native.TextAt(Native.tandem_server_fault_text(faults)); }
}

/// Zero-terminated copies of texts in UTF-8, which exist for the duration of a call.
sealed class Texts : IDisposable {
  public IntPtr Add(string text) {
    if (text == null) return IntPtr.Zero;
    if (text.IndexOf('\0') >= 0) throw new ArgumentException("a text contains the character 0, which would end it");
    var bytes = Encoding.UTF8.GetBytes(text + "\0");
    var memory = Marshal.AllocHGlobal(bytes.Length);
    texts_.Add(memory);
    Marshal.Copy(bytes, 0, memory, bytes.Length);
    return memory;
  }
  public void Dispose() {
    foreach (var text in texts_) Marshal.FreeHGlobal(text);
    texts_.Clear();
  }

  readonly System.Collections.Generic.List<IntPtr> texts_ = new System.Collections.Generic.List<IntPtr>();
}

/// Functions of tandem.h.
static class Native {
#if UNITY_5_3_OR_NEWER
  const string File = "tandem";  // Assets/Plugins/x86_64/libtandem.so
#else
  const string File = "libtandem.so.0";
#endif

  [StructLayout(LayoutKind.Sequential)]
  internal struct DeviceSettings {
    public uint struct_size;
    public Abilities abilities;
    public IntPtr name;
    public double force_limit_n, torque_limit_n_m, force_maximum_n, torque_maximum_n_m;
    public IntPtr maximum_source;
    public Vector workspace_m;
    public double reach_m, speed_limit_m_per_s, slew_limit_n_per_s, slew_limit_n_m_per_s;
    public double position_step_m, rotation_step_rad, stiffness_maximum_n_per_m, damping_maximum_n_s_per_m;
  }

  [StructLayout(LayoutKind.Sequential)]
  internal struct ClientSettings {
    public uint struct_size;
    public Role role;
    public IntPtr server, room, user_name, invitation, pin, authorities, token;
    public uint is_insecure, uses_tcp;
    public ulong own_device;
    public IntPtr device, profile, hand, stage, predictor;
    public uint has_no_passivity;
    public int realtime_priority;
    public uint has_simulated_link, has_no_cache;
    public IntPtr firmware;
    public double motor_counts_per_n_m;
    public IntPtr library, service, motors;
  }

  [StructLayout(LayoutKind.Sequential)]
  internal struct Session {
    public uint struct_size;
    public SessionState state;
    public uint user;
    public Role role;
    public uint is_running, reconnects;
    public ulong lost_ticks;
    public double round_trip_s;
    [MarshalAs(UnmanagedType.ByValArray, SizeConst = 72)] public byte[] room;
    [MarshalAs(UnmanagedType.ByValArray, SizeConst = 40)] public byte[] law;
    [MarshalAs(UnmanagedType.ByValArray, SizeConst = 40)] public byte[] stage;
    [MarshalAs(UnmanagedType.ByValArray, SizeConst = 512)] public byte[] reason;
    [MarshalAs(UnmanagedType.ByValArray, SizeConst = 512)] public byte[] note;
    public ulong lost_events;
    [MarshalAs(UnmanagedType.ByValArray, SizeConst = 72)] public byte[] device;
  }

  [StructLayout(LayoutKind.Sequential)]
  internal struct Event {
    public uint struct_size;
    public EventKind kind;
    public uint user, body, code, tag;
    public double value;
    public uint text_bytes, reserved;
  }

  internal static uint SizeOf<T>() { return Sizes<T>.Size; }
  static class Sizes<T> { internal static readonly uint Size = (uint)Marshal.SizeOf(typeof(T)); }

  /// Throws if the status is an error.
  internal static Status Check(Status status) {
    if (status >= 0) return status;
    var text = TextAt(tandem_last_error());
    throw new TandemException(status, text != "" ? text : TextAt(tandem_status_text(status)));
  }
  internal static string TextAt(IntPtr text) {
    int length = 0;
    while (Marshal.ReadByte(text, length) != 0) ++length;
    var bytes = new byte[length];
    Marshal.Copy(text, bytes, 0, length);
    return Encoding.UTF8.GetString(bytes);
  }
  internal static string TextOf(byte[] bytes) {
    var end = Array.IndexOf(bytes, (byte)0);
    return Encoding.UTF8.GetString(bytes, 0, end < 0 ? bytes.Length : end);
  }

  [DllImport(File)] internal static extern IntPtr tandem_status_text(Status status);
  [DllImport(File)] internal static extern IntPtr tandem_last_error();
  [DllImport(File)] internal static extern IntPtr tandem_version();
  [DllImport(File)] internal static extern uint tandem_protocol_version();
  [DllImport(File)] internal static extern IntPtr tandem_server_fault_text(uint faults);
  [DllImport(File)] internal static extern Status tandem_device_open(ref DeviceSettings settings, out ulong device);
  [DllImport(File)] internal static extern Status tandem_device_feed(ulong device, ref Sample sample);
  [DllImport(File)] internal static extern Status tandem_device_force(ulong device, ref Force force);
  [DllImport(File)] internal static extern Status tandem_device_close(ulong device);
  [DllImport(File)] internal static extern Status tandem_client_open(ref ClientSettings settings, out ulong client);
  [DllImport(File)] internal static extern Status tandem_client_join(ulong client);
  [DllImport(File)] internal static extern Status tandem_client_wait_joined(ulong client, double timeout_s);
  [DllImport(File)] internal static extern Status tandem_client_start(ulong client);
  [DllImport(File)] internal static extern Status tandem_client_stop(ulong client);
  [DllImport(File)] internal static extern Status tandem_client_close(ulong client);
  [DllImport(File)] internal static extern Status tandem_client_session(ulong client, ref Session session);
  [DllImport(File)] internal static extern Status tandem_client_snapshot(ulong client, ref Room room, ref Tick tick);
  [DllImport(File)] internal static extern Status tandem_client_bodies(ulong client, [In, Out] Body[] bodies,
                                                                       uint capacity, out uint count);
  [DllImport(File)] internal static extern Status tandem_client_users(ulong client, [In, Out] User[] users,
                                                                      uint capacity, out uint count);
  [DllImport(File)] internal static extern Status tandem_client_read_ticks(ulong client, [In, Out] Tick[] ticks,
                                                                           uint capacity, out uint count);
  [DllImport(File)] internal static extern Status tandem_client_next_event(ulong client, ref Event about,
                                                                           [In, Out] byte[] text, UIntPtr text_size);
  [DllImport(File)] internal static extern Status tandem_client_wait_event(ulong client, double timeout_s);
  [DllImport(File)] internal static extern Status tandem_client_event_descriptor(ulong client, out int descriptor);
  [DllImport(File)] internal static extern Status tandem_client_grab(ulong client, uint body);
  [DllImport(File)] internal static extern Status tandem_client_release(ulong client);
  [DllImport(File)] internal static extern Status tandem_client_point(ulong client, uint body, ref Vector place_W_m);
  [DllImport(File)] internal static extern Status tandem_client_set_parameter(ulong client, IntPtr name, double value);
  [DllImport(File)] internal static extern Status tandem_client_set_law(ulong client, IntPtr law);
  [DllImport(File)] internal static extern Status tandem_client_set_stage(ulong client, IntPtr stage, IntPtr predictor,
                                                                          uint has_passivity);
  [DllImport(File)] internal static extern Status tandem_client_set_link(ulong client, double delay_s, double jitter_s,
                                                                         double loss);
  [DllImport(File)] internal static extern Status tandem_client_reset_room(ulong client);
  [DllImport(File)] internal static extern Status tandem_client_change_room(ulong client, IntPtr room);
  [DllImport(File)] internal static extern Status tandem_client_set_nudges(ulong client, uint has_nudges);
  [DllImport(File)] internal static extern Status tandem_client_set_workspace(ulong client, double scale,
                                                                              double turn_rad);
  [DllImport(File)] internal static extern Status tandem_client_request_pose(ulong client, PoseRequest request,
                                                                             uint number, IntPtr name, uint tag);
}

}  // namespace Tandem
