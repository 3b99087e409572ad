// Private to this folder: what makes each stage, a source each; stage.cpp has the table of their names. Null for
// settings that the stage cannot use.
#pragma once

#include "client/haptics/stages/stage.hpp"

namespace tandem::client {

/// "local-model": the hand touches the client's own copy of the world (client/model); what the server knows beyond it
/// may be predicted on top.
///
/// Model   wrench = local model + r̂, r the server's wrench less the model's at the same input, continued over its age
///         by the predictor, and bounded by a third of the coupling's limits: it may tell of other hands and of what
///         the model lacks, but a contact that is only late must not push twice. With predictor "none" r̂ is zero, and
///         other users' hands stay where they were last told.
///         Without a local model (its assets are not all here yet): "late-pose".
/// Limits  r̂ closes a loop over the network as "hold" does, with the model's error as its gain
std::unique_ptr<Stage> make_local_model_stage(const StageSettings& settings);

/// "late-pose": local coupling to the newest tool pose of the server. A law whose tool is at the handle has no coupling
/// that could be rendered here: then the server's wrench is shown, as "hold" does.
std::unique_ptr<Stage> make_late_pose_stage(const StageSettings& settings);
/// What it shows.
StageOutput late_pose(const StageInput& input) noexcept;

/// "hold": the newest wrench of the server, unchanged until the next.
std::unique_ptr<Stage> make_hold_stage(const StageSettings& settings);

/// "linear", "ar", "ar-spline": the server's whole wrench, continued over its age
/// (common/haptics/prediction/force_stream.hpp). Bridges the gap between updates and some milliseconds of delay, no
/// more: in stiff contact the loop closes through the network, whatever the predictor.
///
/// Model   samples are stamped with the instant of the server's step on this machine's clock, so that the horizon is
///         the measured age of the data
std::unique_ptr<Stage> make_force_stream_stage(const StageSettings& settings);
/// Contact as a wrench shows it: it appears above one force and vanishes below a lower one.
bool is_contact(const Wrench& wrench, bool was_contact) noexcept;

/// "wave": force and velocity travel as wave variables (common/haptics/wave). Stable at any constant delay, at the
/// price of a line that is felt: heavier in the air and softer in contact the longer it is.
std::unique_ptr<Stage> make_wave_stage(const StageSettings& settings);

/// "god-object": the spring between the hand's point and a ball that never enters a body, at once and without a tool's
/// mass: classical rendering of a shared scene for devices with three force axes. Things that stand feel exact at any
/// delay; what one pushes moves when the server says so, and feels like the server's past. The server's tool follows
/// the handle as it does for "late-pose".
///
/// Model   on hand f = −law(handle − ball), without torque (proxy_force_on_hand_W()); the ball's place is ProxyWorld's
/// Source  Zilles & Salisbury, "A constraint-based god-object method for haptic display", IROS 1995
/// Fails   no force without a ProxyWorld: its assets are not all here yet, or it could not be made
std::unique_ptr<Stage> make_god_object_stage(const StageSettings& settings);

}  // namespace tandem::client
