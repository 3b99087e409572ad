// Reads arbitrary bytes as a contact asset, as a client or the cache does. Every accepted asset must give finite
// results for queries at any point, and must be readable again after it is written. The target first corrects the
// checksum at the end, because otherwise every input would be refused.
#include <cmath>
#include <cstdint>
#include <vector>

#include "common/base/byte_io.hpp"
#include "common/contact/contact_shape.hpp"
#include "tests/fuzz/check.hpp"

namespace {

using tandem::fuzz::check;

void query(const tandem::contact::ContactShape& shape) {
  for (const double share : {-1.0, 0.0, 0.3, 0.5, 0.9, 1.0, 2.0}) {
    const tandem::Vec3 p = shape.low_S + share * (shape.high_S - shape.low_S);
    const tandem::contact::DistanceSample sample = shape.field->sample(p);
    check(std::isfinite(sample.distance_m) && sample.gradient.allFinite());
    check(std::isfinite(shape.field->distance_m(p)));
  }
  double area_m2 = 0;
  for (const tandem::contact::PointShell* shell : {&shape.shells.surface, &shape.shells.features}) {
    for (std::uint32_t i = 0; i < shell->nodes.size(); i = shell->nodes[i].is_leaf ? shell->nodes[i].next : i + 1) {
      const tandem::contact::ShellNode& node = shell->nodes[i];
      if (node.is_leaf) area_m2 += shell->points[node.first + node.count - 1].area_m2;
    }
  }
  check(std::isfinite(area_m2));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < sizeof(std::uint64_t)) {
    check(!tandem::contact::contact_shape_from({data, size}));
    return 0;
  }
  std::vector<std::uint8_t> bytes(data, data + size - sizeof(std::uint64_t));
  tandem::end_asset(bytes);
  const auto shape = tandem::contact::contact_shape_from(bytes);
  if (!shape) return 0;
  query(*shape);
  check(tandem::contact::contact_shape_from(tandem::contact::contact_asset_bytes(*shape)) != nullptr);
  return 0;
}
