// The parts of Unity that TandemHand.cs uses, and a program that runs the script for some frames. Prints one JSON object.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.Reflection;
using System.Threading;

namespace UnityEngine {
public class TooltipAttribute : Attribute {
  public TooltipAttribute(string text) {}
}
public struct Vector3 {
  public float x, y, z;
  public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
}
public struct Quaternion {
  public float x, y, z, w;
  public Quaternion(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; }
}
public class Transform {
  public Vector3 localPosition;
  public Quaternion localRotation;
}
public class GameObject {
  public static readonly Dictionary<string, GameObject> All = new Dictionary<string, GameObject>();
  public readonly Transform transform = new Transform();
  public static GameObject Find(string name) {
    GameObject found;
    return All.TryGetValue(name, out found) ? found : null;
  }
}
public class MonoBehaviour {
  public readonly Transform transform = new Transform();
}
public enum KeyCode { Space }
public static class Input {
  public static bool IsDown;
  public static bool GetKeyDown(KeyCode key) {
    bool wasDown = IsDown;
    IsDown = false;
    return wasDown;
  }
}
public static class Debug {
  public static readonly List<string> Errors = new List<string>();
  public static void Log(object text) {}
  public static void LogWarning(object text) { Errors.Add(text.ToString()); }
  public static void LogError(object text) { Errors.Add(text.ToString()); }
}
}  // namespace UnityEngine

static class Frames {
  // Unity calls the private methods of a script by their names.
  static void Call(TandemHand script, string name) {
    typeof(TandemHand).GetMethod(name, BindingFlags.Instance | BindingFlags.NonPublic).Invoke(script, null);
  }

  static int Main(string[] arguments) {
    var crate = new UnityEngine.GameObject();
    var script = new TandemHand { server = arguments[0], device = "sim" };
    Call(script, "OnEnable");
    uint held = 0;
    double force = 0;
    for (int frame = 0; frame < 1200 && (held == 0 || frame % 60 != 0); ++frame) {
      if (frame % 60 == 30 && held == 0) UnityEngine.Input.IsDown = true;  // tries again after the start
      Call(script, "Update");
      // The object appears when the script has already read the bodies, as after the load of another Unity scene.
      if (script.ForceN > 0) UnityEngine.GameObject.All["crate"] = crate;
      held = script.HeldBody;
      force = Math.Max(force, script.ForceN);
      Thread.Sleep(16);
    }
    var p = crate.transform.localPosition;
    var q = TandemHand.ToUnity(new Tandem.Rotation { w = 0.8, x = 0.6 });  // rotation about x
    Call(script, "OnDisable");
    Call(script, "Update");
    Console.WriteLine(string.Format(
        CultureInfo.InvariantCulture,
        "{{\"held\": {0}, \"crate\": [{1}, {2}, {3}], \"turn\": [{4}, {5}, {6}, {7}], \"errors\": {8}, \"force_n\": {9}}}",
        held, p.x, p.y, p.z, q.w, q.x, q.y, q.z, UnityEngine.Debug.Errors.Count, force));
    foreach (var error in UnityEngine.Debug.Errors) Console.Error.WriteLine(error);
    return 0;
  }
}
