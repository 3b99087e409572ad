// Protobuf part of recordings: descriptions of channels, and conversion of messages.
#pragma once

#include <google/protobuf/message.h>

#include <string>

#include "common/recording/mcap.hpp"

namespace tandem::proto {

/// Returns a channel of messages like `example`, with the descriptors of all files that it needs.
recording::Channel channel_of(const std::string& topic, const google::protobuf::Message& example);

recording::Bytes bytes_of(const google::protobuf::Message& message);
/// Returns false for an invalid message. The values are not checked.
bool parse_recorded(const recording::Message& from, google::protobuf::Message& out);
/// Fails   std::invalid_argument: invalid message; the text has its time
void require_recorded(const recording::Message& from, google::protobuf::Message& out);

}  // namespace tandem::proto
