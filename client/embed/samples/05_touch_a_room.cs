// The C# form of 01_touch_a_room.c.
//
//   mcs 05_touch_a_room.cs ../csharp/Tandem.cs && mono 05_touch_a_room.exe 127.0.0.1:47800
using System;

static class Sample {
  // Returns whether a body was held at the end.
  static bool Touch(string server) {
    var settings = new Tandem.ClientSettings { Server = server, UserName = "sample", IsInsecure = true };
    // The end of the block ramps the force to zero and leaves the room.
    using (var client = new Tandem.Client(settings)) {
      client.Join();
      client.WaitJoined();
      client.Start();
      client.Grab();
      uint held = 0;
      for (int i = 0; i < 20; ++i) {
        client.WaitEvent(0.1);
        for (var found = client.NextEvent(); found != null; found = client.NextEvent()) {
          if (found.Kind == Tandem.EventKind.Grabbed) Console.WriteLine("grabbed body " + found.Body);
          if (found.Kind == Tandem.EventKind.News) Console.WriteLine(found.Text);
        }
        Tandem.Tick tick;
        if (!client.Snapshot(out tick)) continue;
        held = tick.held_body;
        Console.WriteLine("tick {0}: force {1:F2} N upwards, body {2} held", tick.number, tick.on_hand_D.force_n.z,
                          held);
      }
      var bodies = new Tandem.Body[16];
      for (int i = client.ReadBodies(bodies) - 1; i >= 0; --i) {
        Console.WriteLine("{0} is {1:F1} mm above the table", bodies[i].name, 1e3 * bodies[i].pose_W.position_m.z);
      }
      return held != 0;
    }
  }

  static int Main(string[] arguments) {
    try {
      return Touch(arguments.Length > 0 ? arguments[0] : "127.0.0.1:47800") ? 0 : 1;
    } catch (Tandem.TandemException error) {  // the text names the remedy
      Console.Error.WriteLine("05_touch_a_room: " + error.Message);
      return 2;
    }
  }
}
