// The C# form of check.cpp: lifts a body with a device of this program, and compares results that different functions
// of the library return. Prints one JSON object. With the argument "layout" it prints the layout of the structs
// instead.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using System.Reflection;
using System.Runtime.InteropServices;
using System.Threading;

static class Check {
  const int LengthMs = 2500;
  static volatile bool shouldEnd_;
  static readonly Dictionary<ulong, Tandem.Wrench> forces_ = new Dictionary<ulong, Tandem.Wrench>();

  // Supplies the poses of a hand that grabs after 0.5 s and rises after 1 s, and collects the forces.
  static void Drive(Tandem.OwnDevice device) {
    var sample = new Tandem.Sample();
    for (int i = 0; !shouldEnd_; ++i) {
      if (i > 1000 && i < 2000) sample.handle_D.position_m.z = 2e-5 * (i - 1000);
      sample.buttons = i > 500 ? Tandem.Buttons.Grab : Tandem.Buttons.None;
      device.Feed(sample);
      var force = device.ReadForce();
      if (force.is_stale == 0 && !forces_.ContainsKey(force.commands)) forces_.Add(force.commands, force.on_hand_D);
      Thread.Sleep(1);
    }
  }

  static string Text(double value) { return value.ToString("R", CultureInfo.InvariantCulture); }

  static void Run(string server) {
    var limits = new Tandem.DeviceSettings { ForceLimitN = 6, ForceMaximumN = 6, MaximumSource = "this test" };
    using (var device = new Tandem.OwnDevice(limits)) {
      var hand = new Thread(() => Drive(device));
      hand.Start();
      var settings = new Tandem.ClientSettings { Server = server, IsInsecure = true, OwnDevice = device };
      settings.UserName = "Zoë";
      settings.Stage = "late-pose";  // displays the tool of the server, which the recording contains
      var client = new Tandem.Client(settings);
      client.Join();
      client.WaitJoined();
      client.Start();
      Thread.Sleep(LengthMs);
      Tandem.Room room;
      Tandem.Tick newest;
      client.Snapshot(out room, out newest);
      var session = client.ReadSession();
      var bodies = new Tandem.Body[8];
      int count = client.ReadBodies(bodies);
      client.Stop();
      shouldEnd_ = true;
      hand.Join();

      ulong compared = 0, different = 0, all = 0;
      double largest = 0;
      var tools = new SortedDictionary<ulong, Tandem.Pose>();
      var ticks = new Tandem.Tick[1000];
      for (int read = client.ReadTicks(ticks); read > 0; read = client.ReadTicks(ticks)) {
        for (int i = 0; i < read; ++i) {
          ++all;
          tools[ticks[i].server_step] = ticks[i].tool_W;
          largest = Math.Max(largest, -ticks[i].on_hand_D.force_n.z);
          Tandem.Wrench force;
          if (!forces_.TryGetValue(ticks[i].number, out force)) continue;
          ++compared;
          if (!force.Equals(ticks[i].on_hand_D)) ++different;
        }
      }
      var kinds = new List<string>();
      for (var found = client.NextEvent(); found != null; found = client.NextEvent()) kinds.Add(found.Kind.ToString());
      client.Dispose();
      string afterClose = "";
      try {
        client.ReadSession();
      } catch (Tandem.TandemException error) {
        afterClose = error.Status.ToString();
      }
      Console.WriteLine(
          "{{\"user\": {0}, \"held\": {1}, \"ticks\": {2}, \"compared\": {3}, \"different\": {4}, \"largest_n\": {5}, " +
              "\"lost\": {6}, \"bodies\": [{7}], \"room\": \"{8}\", \"stage\": \"{9}\", \"kinds\": [{10}], " +
              "\"after_close\": \"{11}\", \"body_count\": {12}, \"version\": \"{13}\", \"tools\": {{{14}}}}}",
          session.User, newest.held_body, all, compared, different, Text(largest), session.LostTicks,
          string.Join(", ", bodies.Take(count).Select(each => "\"" + each.name + "\"")), session.Room, session.Stage,
          string.Join(", ", kinds.Select(each => "\"" + each + "\"")), afterClose, room.body_count,
          Tandem.Library.Version,
          string.Join(", ", tools.Select(each => "\"" + each.Key + "\": [" + Text(each.Value.position_m.x) + ", " +
                                                 Text(each.Value.position_m.y) + ", " +
                                                 Text(each.Value.position_m.z) + "]")));
    }
  }

  // Prints "struct field offset" for all fields of a struct, and its size.
  static void PrintLayout(string name, Type type) {
    const BindingFlags all = BindingFlags.Instance | BindingFlags.Public | BindingFlags.NonPublic;
    foreach (var field in type.GetFields(all)) {
      Console.WriteLine("{0} {1} {2}", name, field.Name, Marshal.OffsetOf(type, field.Name));
    }
    Console.WriteLine("{0} sizeof {1}", name, Marshal.SizeOf(type));
  }

  static void PrintLayouts() {
    var assembly = typeof(Tandem.Client).Assembly;
    PrintLayout("tandem_pose", typeof(Tandem.Pose));
    PrintLayout("tandem_twist", typeof(Tandem.Twist));
    PrintLayout("tandem_wrench", typeof(Tandem.Wrench));
    PrintLayout("tandem_sample", typeof(Tandem.Sample));
    PrintLayout("tandem_force", typeof(Tandem.Force));
    PrintLayout("tandem_tick", typeof(Tandem.Tick));
    PrintLayout("tandem_snapshot", typeof(Tandem.Room));
    PrintLayout("tandem_body", typeof(Tandem.Body));
    PrintLayout("tandem_user", typeof(Tandem.User));
    PrintLayout("tandem_device_settings", assembly.GetType("Tandem.Native+DeviceSettings"));
    PrintLayout("tandem_client_settings", assembly.GetType("Tandem.Native+ClientSettings"));
    PrintLayout("tandem_session", assembly.GetType("Tandem.Native+Session"));
    PrintLayout("tandem_event", assembly.GetType("Tandem.Native+Event"));
  }

  static int Main(string[] arguments) {
    try {
      if (arguments[0] == "layout") PrintLayouts();
      else Run(arguments[0]);
      return 0;
    } catch (Tandem.TandemException error) {
      Console.Error.WriteLine("check: " + error.Message);
      return 2;
    }
  }
}
