// Tests that WIRE.md matches the code, because the document is normative. Its tables are read and compared.
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <bit>
#include <fstream>
#include <map>
#include <set>

#include "common/base/tick_faults.hpp"
#include "common/net/deadband.hpp"
#include "proto/control_framing.hpp"
#include "proto/coupling_fields.hpp"
#include "proto/datagram_channel.hpp"
#include "proto/datagram_seal.hpp"
#include "proto/join_token.hpp"
#include "proto/state_codec.hpp"
#include "tandem/state.pb.h"
#include "tests/support/source_path.hpp"

namespace tandem::proto {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptor;
using testing::UnorderedElementsAreArray;

using Row = std::vector<std::string>;
using Table = std::vector<Row>;  ///< without the header row

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(' ');
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

/// Returns the cells of a table row `| a | b |`. A bar after a backslash is part of its cell.
Row cells_of(const std::string& line) {
  Row cells;
  std::string cell;
  for (std::size_t i = 1; i < line.size(); ++i) {
    if (line[i] == '|' && line[i - 1] != '\\') {
      cells.push_back(trimmed(cell));
      cell.clear();
    } else {
      cell += line[i];
    }
  }
  return cells;
}

bool is_rule(const Row& row) {
  return !row.empty() && row[0].starts_with("---");
}

/// Returns all tables of WIRE.md under a heading, in order.
std::vector<Table> tables_under(const std::string& heading) {
  std::ifstream file(test::source_path("proto/WIRE.md"));
  EXPECT_TRUE(file.good()) << test::source_path("proto/WIRE.md") << " cannot be read";
  std::vector<Table> tables;
  bool is_here = false;
  Row previous;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("## ")) is_here = line == "## " + heading;
    const Row row = is_here && line.starts_with("|") ? cells_of(line) : Row{};
    if (is_rule(row)) {
      tables.emplace_back();
    } else if (!row.empty() && !previous.empty()) {
      tables.back().push_back(row);
    }
    previous = row;
  }
  EXPECT_FALSE(tables.empty()) << "no table under \"" << heading << '"';
  return tables;
}

Table table_under(const std::string& heading, std::size_t index = 0) {
  const std::vector<Table> tables = tables_under(heading);
  if (index >= tables.size()) {
    ADD_FAILURE() << "no table " << index << " under \"" << heading << '"';
    return {};
  }
  return tables[index];
}

/// Returns a map from the first column to the number in the second.
std::map<std::string, double> numbers_in(const Table& table) {
  std::map<std::string, double> numbers;
  for (const Row& row : table) numbers[row.at(0)] = std::stod(row.at(1));
  return numbers;
}

/// Returns the first `columns` cells of each row.
std::vector<Row> columns_of(const Table& table, std::size_t columns) {
  std::vector<Row> rows;
  for (const Row& row : table) rows.emplace_back(row.begin(), row.begin() + static_cast<std::ptrdiff_t>(columns));
  return rows;
}

std::string type_of(const FieldDescriptor& field) {
  std::string type = field.type_name();
  if (field.message_type() != nullptr) type = field.message_type()->name();
  if (field.enum_type() != nullptr) type = field.enum_type()->name();
  return field.is_repeated() ? "repeated " + type : type;
}

std::vector<Row> fields_of(const FileDescriptor& file) {
  std::vector<Row> rows;
  for (int m = 0; m < file.message_type_count(); ++m) {
    const Descriptor& message = *file.message_type(m);
    for (int f = 0; f < message.field_count(); ++f) {
      const FieldDescriptor& field = *message.field(f);
      rows.push_back({message.name(), std::to_string(field.number()), field.name(), type_of(field)});
    }
  }
  return rows;
}

TEST(WireDocument, ConstantsAreThoseOfTheCode) {
  const std::map<std::string, double> expected{{"kProtocolVersion", kProtocolVersion},
                                               {"kDatagramHeaderBytes", kDatagramHeaderBytes},
                                               {"kMaxDatagramBytes", kMaxDatagramBytes},
                                               {"kMaxPayloadBytes", kMaxPayloadBytes},
                                               {"kMaxEpoch", kMaxEpoch},
                                               {"kTagBytes", kTagBytes},
                                               {"kPathBytes", kPathBytes},
                                               {"kReplayWindow", ReplayWindow::kSize},
                                               {"kMaxDatagramsPerEpoch", kMaxDatagramsPerEpoch},
                                               {"kMaxEpochAge", static_cast<double>(kMaxEpochAge.count())},
                                               {"kMaxTokenBytes", kMaxTokenBytes},
                                               {"kMaxTokenLife_ms", kMaxTokenLife_ms},
                                               {"kMaxSequenceJump", kMaxSequenceJump},
                                               {"kFrameLengthBytes", kFrameLengthBytes},
                                               {"kMaxControlBytes", kMaxControlBytes},
                                               {"kMaxClientControlBytes", kMaxClientControlBytes},
                                               {"kAssetChunkBytes", kAssetChunkBytes},
                                               {"kAssetHashBytes", kAssetHashBytes},
                                               {"kMaxBodies", kMaxBodies},
                                               {"kMaxUsers", kMaxUsers}};
  EXPECT_EQ(numbers_in(table_under("Constants")), expected);
}

TEST(WireDocument, RangesAreThoseOfTheCode) {
  const std::map<std::string, double> expected{{"kMaxPositionM", kMaxPositionM},
                                               {"kMaxSpeedMPerS", kMaxSpeedMPerS},
                                               {"kMaxTurnRadPerS", kMaxTurnRadPerS},
                                               {"kMaxForceN", kMaxForceN},
                                               {"kMaxTorqueNM", kMaxTorqueNM},
                                               {"kMaxEnergyJ", kMaxEnergyJ},
                                               {"kMaxFieldEnergyKjPerMol", kMaxFieldEnergyKjPerMol},
                                               {"kMaxWaveSum", kMaxWaveSum},
                                               {"kMaxContactStiffness", kMaxContactStiffness},
                                               {"kMaxNegativeStiffness", kMaxNegativeStiffness},
                                               {"kMaxDelay", static_cast<double>(kMaxDelay.count())},
                                               {"kMaxQuaternionError", kMaxQuaternionError},
                                               {"kMaxTimestamp", static_cast<double>(kMaxTimestamp.count())}};
  EXPECT_EQ(numbers_in(table_under("Ranges of state")), expected);
}

TEST(WireDocument, ThinningConstantsAreThoseOfTheCode) {
  const std::map<std::string, double> expected{{"kOverdueMessages", ServerUpdateEncoder::kOverdueMessages},
                                               {"kOverduePerMessage", ServerUpdateEncoder::kOverduePerMessage},
                                               {"kMaxWaitMessages", ServerUpdateEncoder::kMaxWaitMessages}};
  EXPECT_EQ(numbers_in(table_under("Thinning of a ServerUpdate")), expected);
}

/// Returns the position of one header field: offset and length of the nonzero bytes of a header in which only this
/// field is set. Byte 0 is ignored.
std::pair<std::size_t, std::size_t> extent_in(const Bytes& header) {
  std::size_t first = 1;
  while (first < header.size() && header[first] == std::byte{0}) ++first;
  std::size_t end = header.size();
  while (end > first && header[end - 1] == std::byte{0}) --end;
  return {first, end - first};
}

TEST(WireDocument, HeaderLayoutIsThatOfTheCode) {
  std::map<std::string, std::pair<std::size_t, std::size_t>> documented;
  std::size_t next = 0;
  for (const Row& row : table_under("Datagram header")) {
    EXPECT_EQ(std::stoul(row.at(0)), next) << row.at(2) << " does not follow the field before it";
    documented[row.at(2)] = {std::stoul(row.at(0)), std::stoul(row.at(1))};
    next += std::stoul(row.at(1));
  }
  EXPECT_EQ(next, kDatagramHeaderBytes);
  Bytes with_connection;
  append_header({.connection = ConnectionId{~0ULL}}, with_connection);
  EXPECT_EQ(documented["connection"], extent_in(with_connection));
  Bytes with_sequence;
  append_header({.connection = {}, .sequence = ~0ULL}, with_sequence);
  EXPECT_EQ(documented["sequence"], extent_in(with_sequence));
  // The tag occupies the rest of the header. hostile_bytes_test.cpp changes each of its bits and expects kTag.
  EXPECT_EQ(documented["tag"], std::pair(kTagOffset, kTagBytes));
  EXPECT_EQ(documented["payload"].first, kDatagramHeaderBytes);
}

TEST(WireDocument, DatagramTypesAreThoseOfTheCode) {
  const auto number = [](DatagramType type) { return std::to_string(static_cast<int>(type)); };
  EXPECT_THAT(columns_of(table_under("Datagram header", 1), 2),
              UnorderedElementsAreArray<Row>({{number(DatagramType::kClientUpdate), "ClientUpdate"},
                                              {number(DatagramType::kServerUpdate), "ServerUpdate"},
                                              {number(DatagramType::kPathResponse), "PathResponse"},
                                              {number(DatagramType::kPathChallenge), "PathChallenge"}}));
}

TEST(WireDocument, DropReasonsAreThoseOfTheCode) {
  std::vector<Row> expected;
  for (unsigned i = 0; i < static_cast<unsigned>(DropReason::kCount); ++i) {
    expected.push_back({std::to_string(i), std::string(name_of(static_cast<DropReason>(i)))});
  }
  EXPECT_EQ(columns_of(table_under("Drop reasons"), 2), expected);
}

TEST(WireDocument, ChecksOnReceiveNameOnlyDropReasons) {
  std::set<std::string> reasons;
  for (const Row& row : table_under("Drop reasons")) reasons.insert(row.at(1));
  unsigned step = 0;
  for (const Row& row : table_under("Checks on receive")) {
    EXPECT_EQ(row.at(0), std::to_string(++step));
    EXPECT_TRUE(reasons.contains(row.at(2))) << row.at(2);
  }
}

/// Returns a datagram that passes the header checks before number `first` and fails that check and later ones. If the
/// checks are made in a wrong order, the reason of the refusal differs.
Bytes failing_from(int first) {
  if (first == 1) return Bytes(kDatagramHeaderBytes - 1);
  Bytes bytes(first == 2 ? kMaxDatagramBytes + 1 : kDatagramHeaderBytes);
  const unsigned version = first <= 3 ? 7 : kProtocolVersion;
  bytes[0] = std::byte(version << 5U);
  if (first > 4) bytes.at(8) = std::byte{1};
  return bytes;
}

TEST(WireDocument, HeaderChecksAreMadeInTheDocumentedOrder) {
  const Table checks = table_under("Checks on receive");
  for (int step = 1; step <= 5; ++step) {
    DatagramHeader header;
    EXPECT_EQ(name_of(parse_header(failing_from(step), header)), checks.at(static_cast<std::size_t>(step) - 1).at(2))
        << "step " << step;
  }
}

TEST(WireDocument, ModesAreThoseOfTheCode) {
  const auto number = [](ClientMode mode) { return std::to_string(static_cast<std::uint32_t>(mode)); };
  const std::vector<Row> expected{{number(ClientMode::kHandle), "kHandle"},
                                  {number(ClientMode::kLocalModel), "kLocalModel"},
                                  {number(ClientMode::kWave), "kWave"}};
  EXPECT_EQ(columns_of(table_under("State messages"), 2), expected);
}

TEST(WireDocument, TheDeadbandsFloorIsThatOfTheCode) {
  const std::map<std::string, double> expected{{"kDeadbandFloor", static_cast<double>(net::kDeadbandFloor.count())}};
  EXPECT_EQ(numbers_in(table_under("Deadband")), expected);
}

TEST(WireDocument, BodyIdsAreThoseOfTheCode) {
  const Table examples = table_under("Ids");
  ASSERT_FALSE(examples.empty());
  for (const Row& row : examples) {
    EXPECT_EQ(std::to_string(body_id_at(std::stoul(row.at(0))).value), row.at(1)) << "at index " << row.at(0);
  }
}

/// Adds the names of the fields in `file` that contain the id of a body or user. They are recognised by their names.
void add_id_fields(const FileDescriptor& file, std::set<std::string>& names) {
  const std::set<std::string> of_ids{"id", "body", "user", "held_body", "holds_body", "held_by_user"};
  for (const Row& field : fields_of(file)) {
    if (of_ids.contains(field[2]) && field[3] == "uint32") names.insert(field[0] + "." + field[2]);
  }
}

TEST(WireDocument, EveryIdFieldStatesTheMeaningOfZero) {
  std::set<std::string> expected;
  add_id_fields(*wire::ClientUpdate::descriptor()->file(), expected);
  add_id_fields(*wire::ClientControl::descriptor()->file(), expected);
  std::set<std::string> documented;
  for (const Row& row : table_under("Ids", 1)) {
    documented.insert(row.at(0));
    EXPECT_FALSE(row.at(2).empty()) << row.at(0);
  }
  EXPECT_EQ(documented, expected);
}

std::string bit_number(std::uint32_t bit) {
  EXPECT_TRUE(std::has_single_bit(bit)) << bit;
  return std::to_string(std::countr_zero(bit));
}

TEST(WireDocument, ButtonsAreThoseOfTheCode) {
  const std::vector<Row> expected{{bit_number(kButtonGrab), "kButtonGrab"},
                                  {bit_number(kButtonClutch), "kButtonClutch"}};
  EXPECT_EQ(columns_of(table_under("Buttons"), 2), expected);
}

TEST(WireDocument, TickFaultsAreThoseOfTheCode) {
  std::vector<Row> expected;
  for (TickFaults bit = 1; bit != 0; bit <<= 1U) {
    const std::string name = describe_faults(bit);
    if (!name.starts_with("bit_")) expected.push_back({bit_number(bit), name});
  }
  EXPECT_EQ(columns_of(table_under("Tick faults"), 2), expected);
}

TEST(WireDocument, SettableParametersAreThoseOfTheCode) {
  const Table documented = table_under("Settable parameters");
  ASSERT_EQ(documented.size(), kCouplingFields.size());
  for (std::size_t i = 0; i < documented.size(); ++i) {
    const CouplingField& field = kCouplingFields[i];
    EXPECT_EQ(documented[i].at(0), field.name);
    EXPECT_EQ(std::stod(documented[i].at(1)), field.low) << field.name;
    EXPECT_EQ(std::stod(documented[i].at(2)), field.high) << field.name;
  }
}

TEST(WireDocument, CapabilitiesAreThoseOfTheCode) {
  const std::vector<Row> expected{{"kCapabilityStateUdp", kCapabilityStateUdp},
                                  {"kCapabilityStateTcp", kCapabilityStateTcp}};
  EXPECT_EQ(columns_of(table_under("Capabilities"), 2), expected);
}

TEST(WireDocument, EveryRequestHasAnAnswerThatTheServerCanSend) {
  const Descriptor& server = *wire::ServerControl::descriptor();
  const google::protobuf::OneofDescriptor& requests = *wire::ClientControl::descriptor()->oneof_decl(0);
  std::set<std::string> documented;
  for (const Row& row : table_under("Control messages", 1)) {
    documented.insert(row.at(0));
    EXPECT_TRUE(row.at(1) == "nothing" || server.FindFieldByName(row.at(1)) != nullptr) << row.at(1);
  }
  std::set<std::string> expected;
  for (int i = 0; i < requests.field_count(); ++i) expected.insert(requests.field(i)->name());
  EXPECT_EQ(documented, expected);
}

TEST(WireDocument, EnumsAreThoseOfTheSchema) {
  std::vector<Row> expected;
  const FileDescriptor& file = *wire::ClientControl::descriptor()->file();
  for (int e = 0; e < file.enum_type_count(); ++e) {
    for (int v = 0; v < file.enum_type(e)->value_count(); ++v) {
      const auto& value = *file.enum_type(e)->value(v);
      expected.push_back({file.enum_type(e)->name(), std::to_string(value.number()), value.name()});
    }
  }
  EXPECT_THAT(columns_of(table_under("Numbers of the enums"), 3), UnorderedElementsAreArray(expected));
}

}  // namespace
}  // namespace tandem::proto
