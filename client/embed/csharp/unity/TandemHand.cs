// Unity script: joins a room and shows its bodies and the hand. The force does not depend on Unity's frames.
//
// 1. Copy Tandem.cs and this file to Assets/, and libtandem.so.0 as libtandem.so to Assets/Plugins/x86_64/.
// 2. Add this script to an object, which becomes the hand. Objects with the names of the scene's bodies follow them.
// 3. The space bar grabs the nearest body or releases the held one. A button of the device does the same.
using System;
using System.Collections.Generic;
using UnityEngine;

public class TandemHand : MonoBehaviour {
  public string server = "127.0.0.1:47800", invitation = "", device = "auto", userName = "unity";
  [Tooltip("Unity units for 1 m of the room")] public float scale = 10;

  public uint HeldBody { get; private set; }
  public double ForceN { get; private set; }

  // Converts a position. The room is right-handed with z up, Unity is left-handed with y up, so y and z are exchanged.
  // The exchange is a reflection, so it also inverts the sense of rotations.
  public static Vector3 ToUnity(Tandem.Vector p, float scale) {
    return new Vector3(scale * (float)p.x, scale * (float)p.z, scale * (float)p.y);
  }
  public static Quaternion ToUnity(Tandem.Rotation q) {
    return new Quaternion(-(float)q.x, -(float)q.z, -(float)q.y, (float)q.w);
  }

  // Opening a device may block for a second or more, in which no frame is drawn. Joining does not block.
  void OnEnable() {
    try {
      client_ = new Tandem.Client(new Tandem.ClientSettings {
        Server = server, Invitation = invitation, IsInsecure = invitation == "", Device = device, UserName = userName,
      });
      client_.Join();
    } catch (Tandem.TandemException error) {
      Debug.LogError(error.Message);  // the message names the remedy
      OnDisable();
    }
  }

  // Unity calls this function at the end of the play mode too, so no force remains.
  void OnDisable() {
    if (client_ != null) client_.Dispose();
    client_ = null;
    isRunning_ = false;
    bodies_.Clear();
  }

  void Update() {
    if (client_ == null) return;
    try {
      if (!isRunning_) StartWhenJoined();
      ShowEvents();
      if (isRunning_) Follow();
      if (isRunning_ && Input.GetKeyDown(KeyCode.Space)) Toggle();
    } catch (Tandem.TandemException error) {
      Debug.LogError(error.Message);
      OnDisable();
    }
  }

  void StartWhenJoined() {
    var session = client_.ReadSession();
    if (session.State == Tandem.SessionState.Ended) throw new Tandem.TandemException(Tandem.Status.Ended, session.Reason);
    if (session.State != Tandem.SessionState.Joined) return;
    client_.Start();
    isRunning_ = true;
  }

  void ShowEvents() {
    for (var found = client_.NextEvent(); found != null; found = client_.NextEvent()) {
      if (found.Kind == Tandem.EventKind.Joined) bodies_.Clear();  // ids now refer to the new scene
      if (found.Kind == Tandem.EventKind.News) Debug.Log(found.Text);
      if (found.Kind == Tandem.EventKind.Refused) Debug.LogWarning(found.Text);
    }
  }

  void Follow() {
    Tandem.Tick tick;
    if (!client_.Snapshot(out tick)) return;
    HeldBody = tick.held_body;
    var f = tick.on_hand_D.force_n;
    ForceN = Math.Sqrt(f.x * f.x + f.y * f.y + f.z * f.z);
    transform.localPosition = ToUnity(tick.tool_W.position_m, scale);
    transform.localRotation = ToUnity(tick.tool_W.rotation_wxyz);
    for (int i = client_.ReadBodies(read_) - 1; i >= 0; --i) {
      GameObject found;
      bodies_.TryGetValue(read_[i].id, out found);
      if (found == null) found = GameObject.Find(read_[i].name.ToString());
      if (found == null) continue;  // the Unity scene has no object with this body's name (yet)
      bodies_[read_[i].id] = found;
      found.transform.localPosition = ToUnity(read_[i].pose_W.position_m, scale);
      found.transform.localRotation = ToUnity(read_[i].pose_W.rotation_wxyz);
    }
  }

  void Toggle() {
    if (HeldBody == 0) client_.Grab();
    else client_.Release();
  }

  Tandem.Client client_;
  bool isRunning_;
  readonly Tandem.Body[] read_ = new Tandem.Body[64];
  readonly Dictionary<uint, GameObject> bodies_ = new Dictionary<uint, GameObject>();
}
