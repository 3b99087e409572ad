// Converts the client's types to the structs of the C interface. The caller of these functions sets struct_size.
#pragma once

#include <string>

#include "client/embed/c/tandem.h"
#include "client/haptics/tick_record.hpp"
#include "client/haptics/view.hpp"
#include "client/net/client_io.hpp"
#include "client/session/event.hpp"

namespace tandem::client::embed {

tandem_pose c_pose(const Pose& X);
tandem_twist c_twist(const Twist& V);
tandem_wrench c_wrench(const Wrench& F);
tandem_tick c_tick(const TickRecord& record);
tandem_snapshot c_snapshot(const View& view);
tandem_body c_body(const proto::BodyState& body, const wire::Scene& scene);
tandem_user c_user(const proto::OtherUserState& user, const wire::UserJoined& known);
tandem_session c_session(const ClientIoSnapshot& io);

struct EventAndText {
  tandem_event event{};
  std::string text;
};
EventAndText c_event(const Event& event);

}  // namespace tandem::client::embed
