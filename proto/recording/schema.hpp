// Protobuf's side of a recording: what a channel says of its messages, and messages to bytes.
#pragma once

#include <google/protobuf/message.h>

#include <string>

#include "common/recording/mcap.hpp"

namespace tandem::proto {

/// A channel of messages like `example`, with the descriptors of all files that it needs.
recording::Channel channel_of(const std::string& topic, const google::protobuf::Message& example);

recording::Bytes bytes_of(const google::protobuf::Message& message);
/// False: no such message. Nothing in it is checked.
bool parse_recorded(const recording::Message& from, google::protobuf::Message& out);
/// Fails   std::invalid_argument: no such message, with its time
void require_recorded(const recording::Message& from, google::protobuf::Message& out);

}  // namespace tandem::proto
