#include "client/view/molecule/molecule_mouse.hpp"

#include <cstdio>
#include <utility>

namespace tandem::client {
namespace {

/// Returns a text that identifies the molecules of a scene: their assets in the order of the bodies. It does not change
/// when the user rejoins the same room.
std::string molecules_of(const wire::Scene& scene) {
  std::string text;
  for (const wire::Body& body : scene.bodies()) {
    for (const wire::Shape& shape : body.shapes()) {
      if (shape.has_molecule()) text += shape.molecule().asset_sha256();
    }
    text += '\n';
  }
  return text;
}

}  // namespace

void MoleculeMouse::follow(const MoleculeFrame& frame) {
  under_mouse_.reset();
  if (frame.is_free || frame.is_click) {
    under_mouse_ = first_atom(frame.scene, frame.X_WB, frame.metres_per_angstrom, frame.from_W, frame.along_W);
  }
  if (frame.is_double_click) {
    if (clicked_at_ && frame.now - *clicked_at_ < kDoubleClick) selection_ = before_click_;
    clicked_at_.reset();
    doubled_at_ = frame.now;
    ignores_click_ = true;
  }
  if (frame.is_click) {
    click(frame);
  } else if (frame.is_free) {
    ignores_click_ = false;  // the mouse was moved during the second press, so no click follows
  }
  distance_ = selection_.distance(frame.scene, frame.X_WB, frame.metres_per_angstrom);
}

void MoleculeMouse::click(const MoleculeFrame& frame) {
  // In a slow frame, both presses of a double click may be received before the first release. The second click is then
  // recognised by its time.
  const bool is_of_double_click = doubled_at_ && frame.now - *doubled_at_ < kDoubleClick;
  if (std::exchange(ignores_click_, false) || is_of_double_click || !under_mouse_) return;
  before_click_ = selection_;
  clicked_at_ = frame.now;
  selection_.click(frame.scene, *under_mouse_);
  problem_.clear();
}

void MoleculeMouse::clear() {
  selection_.clear();
  clicked_at_.reset();
  under_mouse_.reset();
  distance_.reset();
  problem_.clear();
}

void MoleculeMouse::belong_to(const std::shared_ptr<const wire::Joined>& joined) {
  if (joined == nullptr || joined == joined_) return;
  joined_ = joined;
  selection_.belong_to(molecules_of(joined->scene()));
  if (selection_.is_empty()) distance_.reset();
}

MoleculeContent MoleculeMouse::content(const DrawnScene& scene) {
  MoleculeContent content{.selection = &selection_, .scene = &scene, .problem = &problem_};
  const docking::Molecule* const molecule = under_mouse_ ? molecule_at(scene, *under_mouse_) : nullptr;
  if (molecule != nullptr) content.under_mouse = atom_text(*molecule, under_mouse_->atom);
  if (!distance_) return content;
  char text[48];
  std::snprintf(text, sizeof text, "%.2f Å from ", distance_->angstrom);
  content.distance = text;
  for (const AtomPlace& place : selection_.picked()) {
    const docking::Molecule* const picked = molecule_at(scene, place);
    if (&place != &selection_.picked().front()) content.distance += " to ";
    if (picked != nullptr) content.distance += short_atom_text(*picked, place.atom);
  }
  return content;
}

}  // namespace tandem::client
