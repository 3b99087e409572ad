// A complete session in one process and in virtual time. It consists of the same classes as a live session.
//
// Time advances in slots of 0.25 ms. The events in a slot have this order:
//
//   0 network       packets that are due arrive at both ends. A packet that is sent in events 1 to 4 arrives in a later
//                   slot
//   1 server io     arrived bytes and datagrams are passed to SessionHub
//   2 room          makes a step, if one is due (phase: Experiment::server_phase)
//   3 server io     SessionHub::poll() sends the states that the room published
//   4 each client   arrived packets are passed to ClientSession; the haptic tick runs, if due (each client has its
//                   own phase within the millisecond); ClientSession::poll() sends the update of the tick
//
// The order of events depends on nothing else, in particular not on the host. A packet is received at the earliest in
// the slot after it was sent. This has three consequences:
// * The order of the clients within a slot has no influence.
// * Delays are rounded up to whole slots.
// * A link without delay takes one slot in each direction.
#pragma once

#include <functional>
#include <memory>
#include <stdexcept>

#include "client/client.hpp"
#include "lab/experiment/experiment.hpp"
#include "lab/session/trace.hpp"

namespace tandem::lab {

/// Thrown if a user could not join, because the link is too bad or the scene was refused.
struct CouldNotJoin : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Called before each haptic tick of a moving hand, to simulate the user's actions in the client's window.
using OnClient = std::function<void(std::size_t user, Duration time, client::Client& client)>;

/// Runs one trial of an experiment.
///
/// The users join one after the other. Therefore the n-th manipulator gets the n-th tool, regardless of the delays of
/// the links. After the last user has joined, all hands start on their paths at the same time, which is time 0 of the
/// trace.
/// In      on_tick    called after each haptic tick of a moving hand
///         on_client  called before each haptic tick of a moving hand
/// Fails   std::invalid_argument: the scene has fewer tools than there are manipulators; CouldNotJoin (names user and
///         reason)
SessionTrace run_virtual_session(const Experiment& experiment, const std::shared_ptr<const server::LoadedScene>& scene,
                                 const OnTick& on_tick = {}, const OnClient& on_client = {});

}  // namespace tandem::lab
