#include "client/view/molecule/molecule_mouse.hpp"

#include <cstdio>

namespace tandem::client {

void MoleculeMouse::follow(const MoleculeFrame& frame) {
  under_mouse_.reset();
  if (frame.is_free || frame.is_click) {
    under_mouse_ = first_atom(frame.scene, frame.X_WB, frame.metres_per_angstrom, frame.from_W, frame.along_W);
  }
  if (frame.is_click && under_mouse_) {
    selection_.click(frame.scene, *under_mouse_);
    problem_.clear();
  }
  distance_ = selection_.distance(frame.scene, frame.X_WB, frame.metres_per_angstrom);
}

void MoleculeMouse::clear() {
  selection_.clear();
  under_mouse_.reset();
  distance_.reset();
  problem_.clear();
}

void MoleculeMouse::belong_to(const void* scene) {
  selection_.belong_to(scene);
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
