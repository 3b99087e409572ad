// Private to this folder: factory functions of the stages, each in its own source; stage.cpp has the table of their
// names. They return null for settings that the stage cannot use.
#pragma once

#include "client/haptics/stages/stage.hpp"

namespace tandem::client {

/// "local-model": the hand touches the client's local model (client/model). The residual force, server minus local
/// model, may be predicted and added.
///
/// Model   wrench = local model + r̂. The residual r is the server's wrench less the model's at the same input. The
///         predictor continues it over its age. r̂ covers other hands and errors of the model. It is bounded by a third
///         of the coupling's limits, because a contact that is only late must not push twice. With predictor "none" r̂
///         is zero, and other users' hands stay at their last received poses.
///         Without a local model (for example while its assets are fetched): "late-pose".
/// Limits  r̂ closes a loop over the network as "hold" does, with the model's error as its gain
std::unique_ptr<Stage> make_local_model_stage(const StageSettings& settings);

/// "late-pose": local coupling to the newest tool pose of the server. A law that places the tool at the handle has no
/// spring to render here: then the server's wrench is displayed, as by "hold".
std::unique_ptr<Stage> make_late_pose_stage(const StageSettings& settings);
/// Output of the stage "late-pose".
StageOutput late_pose(const StageInput& input) noexcept;

/// "hold": the newest wrench of the server, unchanged until the next.
std::unique_ptr<Stage> make_hold_stage(const StageSettings& settings);

/// "linear", "ar", "ar-spline": the server's whole wrench, continued over its age
/// (common/haptics/prediction/force_stream.hpp). Bridges the gap between updates and a few milliseconds of delay only:
/// in stiff contact the loop closes through the network, whatever the predictor.
///
/// Model   samples are stamped with the time of the server's step on this machine's clock, so that the prediction
///         horizon is the measured age of the data
std::unique_ptr<Stage> make_force_stream_stage(const StageSettings& settings);
/// Detects contact from the wrench with hysteresis: begins above one force, ends below a lower one.
bool is_contact(const Wrench& wrench, bool was_contact) noexcept;

/// "wave": force and velocity are sent as wave variables (common/haptics/wave). Stable at any constant delay. The hand
/// feels the line: the longer the delay, the heavier in free motion and the softer in contact.
std::unique_ptr<Stage> make_wave_stage(const StageSettings& settings);

/// "god-object": a spring between the hand's point and a ball that never enters a body, without delay and without a
/// tool's mass. This is classical rendering of a shared scene, for devices with three force axes. Static objects feel
/// exact at any delay. Pushed objects move only with the server's states, so their motion is felt late. The server's
/// tool follows the handle as for "late-pose".
///
/// Model   on hand f = −law(handle − ball), without torque (proxy_force_on_hand_W()); ProxyWorld gives the ball's
///         position
/// Source  Zilles & Salisbury, "A constraint-based god-object method for haptic display", IROS 1995
/// Fails   no force without a ProxyWorld, which is missing until its assets have arrived or if it could not be built
std::unique_ptr<Stage> make_god_object_stage(const StageSettings& settings);

}  // namespace tandem::client
