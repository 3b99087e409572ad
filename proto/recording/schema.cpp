#include "proto/recording/schema.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/stubs/logging.h>

#include <set>
#include <stdexcept>

namespace tandem::proto {
namespace {

/// Adds the descriptor of a .proto file. The descriptors of the files that it imports are added first.
void add_file(const google::protobuf::FileDescriptor& file, std::set<std::string>& added,
              google::protobuf::FileDescriptorSet& out) {
  if (!added.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) add_file(*file.dependency(i), added, out);
  file.CopyTo(out.add_file());
}

}  // namespace

recording::Channel channel_of(const std::string& topic, const google::protobuf::Message& example) {
  google::protobuf::FileDescriptorSet files;
  std::set<std::string> added;
  add_file(*example.GetDescriptor()->file(), added, files);
  return {topic, example.GetDescriptor()->full_name(), bytes_of(files)};
}

recording::Bytes bytes_of(const google::protobuf::Message& message) {
  recording::Bytes bytes(message.ByteSizeLong());
  message.SerializeToArray(bytes.data(), static_cast<int>(bytes.size()));
  return bytes;
}

bool parse_recorded(const recording::Message& from, google::protobuf::Message& out) {
  const google::protobuf::LogSilencer silencer;
  return out.ParseFromArray(from.data.data(), static_cast<int>(from.data.size()));
}

void require_recorded(const recording::Message& from, google::protobuf::Message& out) {
  if (parse_recorded(from, out)) return;
  throw std::invalid_argument("a message " + out.GetTypeName() + " of " + std::to_string(from.log_ns) +
                              " ns since 1970 cannot be read; the file is damaged, or of another version");
}

}  // namespace tandem::proto
