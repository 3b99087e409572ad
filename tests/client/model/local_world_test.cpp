// Tests the construction of a local model's world, and the reuse of shapes from the previous world.
#include "client/model/local_world.hpp"

#include <gtest/gtest.h>

#include "common/contact/contact_shape.hpp"
#include "common/geometry/mesh_repair.hpp"
#include "common/geometry/tessellation.hpp"
#include "proto/scene_ranges.hpp"
#include "tests/support/hub_bench.hpp"

namespace tandem::client {
namespace {

using Shape = std::shared_ptr<const contact::ContactShape>;

Shape shape_of_body(const wire::Joined& joined, const AssetMap& assets, ContactShapes& shapes) {
  return make_local_world(joined, assets, shapes)->bodies[0].touch.parts[0].shape;
}

TEST(LocalWorld, IsMadeOfTheShapesOfTheOneBeforeWhereTheyAreAlike) {
  wire::Joined joined = test::HubBench().join("ada").joined;
  ContactShapes shapes;
  const Shape first = shape_of_body(joined, {}, shapes);
  auto& placement = *joined.mutable_scene()->mutable_bodies(0)->mutable_shapes(0)->mutable_placement();
  placement.clear_position_m();
  for (const double position_m : {0.1, 0.2, 0.3}) placement.add_position_m(position_m);
  EXPECT_EQ(shape_of_body(joined, {}, shapes), first);

  auto& size_m = *joined.mutable_scene()->mutable_bodies(0)->mutable_shapes(0)->mutable_box()->mutable_size_m();
  size_m[0] *= 1.5;
  const std::size_t count = shapes.size();
  const Shape longer = shape_of_body(joined, {}, shapes);
  EXPECT_NEAR((longer->high_S - first->high_S).x(), 0.5 * first->high_S.x(), 1e-6);
  EXPECT_EQ(shapes.size(), count) << "a shape outside of the scene must not be cached";
}

TEST(LocalWorld, UsesTheWholeAssetOnceItIsAvailable) {
  const auto mesh = geometry::repaired(geometry::tessellated_box(Vec3::Constant(0.01)));
  const auto asset_of = [&](double spacing_m) {
    contact::ContactShapeOptions options;
    options.spacing_m = spacing_m;
    const auto bytes = contact::contact_asset_bytes(*contact::make_contact_mesh(mesh, options));
    const auto* const begin = reinterpret_cast<const std::byte*>(bytes.data());
    return std::make_shared<const proto::Bytes>(begin, begin + bytes.size());
  };
  wire::Joined joined = test::HubBench().join("ada").joined;
  AssetMap assets;
  const auto offer = [&](const std::shared_ptr<const proto::Bytes>& bytes, const std::string& kind) {
    const proto::Sha256 hash = proto::sha256_of(*bytes);
    wire::AssetInfo& info = *joined.add_assets();
    info.set_kind(kind);
    info.set_sha256(hash.data(), hash.size());
    assets[hash] = bytes;
    return hash;
  };
  const proto::Sha256 fine = offer(asset_of(4.5e-4), "contact");
  offer(asset_of(2e-3), "coarse-contact");
  joined.mutable_assets(1)->set_coarse_of(fine.data(), fine.size());
  wire::Mesh& message = *joined.mutable_scene()->mutable_bodies(0)->mutable_shapes(0)->mutable_mesh();
  message.set_file("box.obj");
  message.set_contact_sha256(fine.data(), fine.size());
  proto::complete_numbers(*joined.mutable_scene());

  AssetMap only_coarse = assets;
  only_coarse.erase(fine);
  ContactShapes shapes;
  const Shape coarse = shape_of_body(joined, only_coarse, shapes);
  const Shape whole = shape_of_body(joined, assets, shapes);
  EXPECT_GT(whole->shells.surface.points.size(), 2 * coarse->shells.surface.points.size());
  EXPECT_EQ(shape_of_body(joined, assets, shapes), whole);
  shapes.clear();
  EXPECT_THROW(make_local_world(joined, {}, shapes), std::runtime_error) << "neither is here";
}

}  // namespace
}  // namespace tandem::client
