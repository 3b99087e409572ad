// Protobuf part of recordings: descriptions of channels, and conversion of messages.
#pragma once

#include <google/protobuf/message.h>

#include <string>

#include "common/recording/mcap.hpp"

namespace tandem::proto {

/// Returns a channel for messages of the same type as `example`. Its schema contains the descriptors of all .proto
/// files that define this type.
recording::Channel channel_of(const std::string& topic, const google::protobuf::Message& example);

recording::Bytes bytes_of(const google::protobuf::Message& message);
/// Parses a recorded message. Returns false if it is not a valid message. Ranges of values are not checked.
bool parse_recorded(const recording::Message& from, google::protobuf::Message& out);
/// Parses a recorded message.
/// Fails   std::invalid_argument: the data is not a valid message; the error text contains the time of the message
void require_recorded(const recording::Message& from, google::protobuf::Message& out);

}  // namespace tandem::proto
