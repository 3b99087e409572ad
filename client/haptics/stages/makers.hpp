// Private to this folder: the factory function of each stage, defined in the source of the stage. stage.cpp contains
// the table of stage names. A function returns null for settings that the stage cannot use.
#pragma once

#include "client/haptics/stages/stage.hpp"

namespace tandem::client {

/// "local-model": the hand touches the client's local model (client/model). A prediction of the residual force (server
/// minus local model) may be added.
/// Model   wrench = wrench of the local model + r̂
///         r: residual, the server's wrench minus the model's wrench for the same input
///         r̂: prediction of r for the current time. It represents other users' hands and errors of the model. It is
///         limited to a third of the coupling's limits; without this limit, a contact that the server reports late
///         would be displayed twice. With the predictor "none", r̂ is zero, and other users' hands stay at their last
///         received poses.
///         Without a local model (for example while its assets are fetched), the output is that of "late-pose".
/// Limits  Like the stage "hold", r̂ closes a control loop over the network. The gain of this loop is the relative
///         error of the model
std::unique_ptr<Stage> make_local_model_stage(const StageSettings& settings);

/// "late-pose": local coupling between the handle and the newest received pose of the tool. Under a law that places the
/// tool at the handle, there is no spring to render. The server's wrench is then displayed, as by "hold".
std::unique_ptr<Stage> make_late_pose_stage(const StageSettings& settings);
/// Computes the output of the stage "late-pose", which stages without a model use too.
StageOutput late_pose(const StageInput& input) noexcept;

/// "hold": zero-order hold of the newest wrench of the server.
std::unique_ptr<Stage> make_hold_stage(const StageSettings& settings);

/// "linear", "ar", "ar-spline": the server's wrench, extrapolated over its age by the predictor of this name
/// (common/haptics/prediction/force_stream.hpp). The prediction bridges only the gap between updates and a few
/// milliseconds of delay. The loop of stiff contact is still closed over the network.
///
/// Model   The time stamp of a sample is the time of the server's step on the local clock. So the prediction horizon is
///         the measured age of the data.
std::unique_ptr<Stage> make_force_stream_stage(const StageSettings& settings);
/// Detects contact from the wrench with hysteresis: contact begins above an upper threshold and ends below a lower one.
bool is_contact(const Wrench& wrench, bool was_contact) noexcept;

/// "wave": force and velocity are sent as wave variables (common/haptics/wave), so the loop is stable at any constant
/// delay. The longer the delay, the heavier free motion feels and the softer contact feels.
std::unique_ptr<Stage> make_wave_stage(const StageSettings& settings);

/// "god-object": classical god-object rendering of a shared scene, for devices with three force axes. A spring acts
/// between the handle (haptic interface point) and a massless ball that never enters a body. Both are computed locally,
/// so the force of static objects is exact at any delay. Pushed objects move only when new states of the server arrive,
/// so their motion is felt late. At the server the tool follows the handle as for "late-pose".
///
/// Model   The force on the hand is f = −law(handle − ball), without torque (proxy_force_on_hand_W()). ProxyWorld
///         computes the ball's position.
/// Source  Zilles & Salisbury, "A constraint-based god-object method for haptic display", IROS 1995
/// Fails   the force is zero while there is no ProxyWorld, because its assets have not arrived or it could not be built
std::unique_ptr<Stage> make_god_object_stage(const StageSettings& settings);

}  // namespace tandem::client
