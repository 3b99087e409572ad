#include "client/start/shipped_scenes.hpp"

#include <algorithm>
#include <array>

namespace tandem::client {
namespace {

// A test requires that every scene in server/scenes with a description is listed here.
constexpr std::array kScenes{
    ShippedScene{"crate", "A crate for two", "Lift a heavy crate together with Ben, a simulated partner.",
                 "paths/crate_partner.json"},
    ShippedScene{"two_boxes", "Two boxes", "Push two boxes over a table, or grab and lift them."},
    ShippedScene{"bunny", "A bunny", "Feel a bunny of many triangles all over, and grab a ball."},
    ShippedScene{"effects", "Textures and magnets",
                 "Slide over rough, sticky and buzzing surfaces, and find the magnet."},
    ShippedScene{"soft_pad", "A soft pad", "Press a soft pad with your hand, or with the ball."},
    ShippedScene{"peg_in_hole", "A peg for two", "Bring a peg into its hole, held by two people."},
    ShippedScene{"ring", "A ball and a ring", "A game: put the ball into the ring within 20 seconds."},
    ShippedScene{"basket", "A basket", "A game: put things into a basket, heavier ones from level to level."},
    ShippedScene{"t_puzzle", "The T puzzle", "A game: lay four wooden boards so that they form a T, and more."},
    ShippedScene{"docking_helices", "Two helices", "Dock two helices: feel how molecules attract and repel."},
    ShippedScene{"two_bunnies", "Two bunnies", "Let two bunnies slide on each other, one in each hand."},
    ShippedScene{"squeeze", "A cube to squeeze", "Lift a cube by friction alone, pressed by two people."},
    ShippedScene{"peg_hand_over", "A peg to hand over", "Hand a peg to another user, who puts it into its hole."},
    ShippedScene{"mass", "A mass", "Grab a box of 0.2 kg, lift and shake it, and feel its mass."},
    ShippedScene{"push", "A block on a spring", "Push a block that a spring holds at its place."},
    ShippedScene{"rim", "A plate with a hole", "Slide off the edges of a plate, and into its square hole."},
    ShippedScene{"wall", "A wall", "Press against a fixed wall."},
    ShippedScene{"curve", "A ball", "Slide over a fixed ball of 20 mm radius."},
    ShippedScene{"free", "Free space", "Move without touching anything."},
};

}  // namespace

std::span<const ShippedScene> shipped_scenes() {
  return kScenes;
}

const ShippedScene* find_shipped_scene(std::string_view name) {
  const auto found = std::ranges::find(kScenes, name, &ShippedScene::name);
  return found == kScenes.end() ? nullptr : &*found;
}

}  // namespace tandem::client
