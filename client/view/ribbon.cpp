#include "client/view/ribbon.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tandem::client {
namespace {

using docking::Molecule;

enum class Fold : std::uint8_t { kCoil, kHelix, kStrand, kNucleic };

/// One residue of a chain. Coordinates are in Å.
struct Link {
  std::size_t residue = 0;  ///< index of the residue in the molecule
  std::size_t atom = 0;     ///< index of the α carbon (proteins) or of C4' (nucleic acids)
  Vec3 place = Vec3::Zero();
  Vec3 across = Vec3::Zero();  ///< direction of the ribbon's width, perpendicular to the chain; zero: unknown
  Fold fold = Fold::kCoil;
};
using Chain = std::vector<Link>;

constexpr double kMaxPeptideAngstrom = 4.5, kMaxNucleotideAngstrom = 8;
constexpr std::size_t kMinLinks = 3;
/// Half width and half thickness of the ribbon's cross-section [Å].
using Size = Eigen::Vector2d;
const Size kCoilSize(0.28, 0.28), kHelixSize(1.3, 0.22), kStrandSize(1.0, 0.22), kNucleicSize(0.6, 0.6);
constexpr double kArrowAngstrom = 1.7, kBaseAngstrom = 0.35;
constexpr int kBaseSides = 8;
/// Level of detail for molecules of up to `max_residues` residues: number of cross-sections for each residue of a
/// chain, and number of corners of a cross-section.
struct Detail {
  std::size_t max_residues;
  int sections, corners;
};
constexpr std::array<Detail, 4> kDetails{{{3000, 8, 12}, {30'000, 4, 6}, {100'000, 2, 4}, {1'000'000, 1, 3}}};

/// Access to the atoms of a molecule by residue.
class Residues {
 public:
  explicit Residues(const Molecule& molecule) : molecule_(molecule), starts_(docking::residue_starts(molecule)) {}

  std::size_t size() const { return starts_.size(); }
  std::size_t begin(std::size_t residue) const { return starts_[residue]; }
  std::size_t end(std::size_t residue) const {
    return residue + 1 < starts_.size() ? starts_[residue + 1] : molecule_.size();
  }
  std::optional<std::size_t> atom(std::size_t residue, std::string_view name) const {
    for (std::size_t i = begin(residue); i < end(residue); ++i) {
      if (molecule_.atom_names[i] == name) return i;
    }
    return std::nullopt;
  }
  const Vec3& place(std::size_t atom) const { return molecule_.positions_angstrom[atom]; }
  bool is_one_chain(std::size_t a, std::size_t b) const {
    const std::size_t i = begin(a), k = begin(b);
    return molecule_.chains[i] == molecule_.chains[k] && molecule_.segments[i] == molecule_.segments[k];
  }
  bool is_carbon(std::size_t atom) const { return molecule_.elements[atom] == "C"; }

 private:
  const Molecule& molecule_;
  std::vector<std::size_t> starts_;
};

std::optional<Link> link_of(const Residues& residues, std::size_t residue) {
  Link link{.residue = residue};
  if (const auto alpha = residues.atom(residue, "CA"); alpha && residues.is_carbon(*alpha)) {
    link.atom = *alpha;
    if (const auto carbonyl = residues.atom(residue, "O")) link.across = residues.place(*carbonyl);
  } else if (const auto sugar = residues.atom(residue, "C4'")) {
    link.atom = *sugar;
    link.fold = Fold::kNucleic;
  } else if (const auto old_sugar = residues.atom(residue, "C4*")) {
    link.atom = *old_sugar;
    link.fold = Fold::kNucleic;
  } else {
    return std::nullopt;
  }
  link.place = residues.place(link.atom);
  return link;
}

bool are_neighbours(const Residues& residues, const Link& a, const Link& b) {
  const bool is_nucleic = a.fold == Fold::kNucleic;
  const double apart = (b.place - a.place).norm();
  return b.residue == a.residue + 1 && is_nucleic == (b.fold == Fold::kNucleic) && apart > 0 &&
         apart < (is_nucleic ? kMaxNucleotideAngstrom : kMaxPeptideAngstrom) &&
         residues.is_one_chain(a.residue, b.residue);
}

std::vector<Chain> chains_of(const Residues& residues) {
  std::vector<Chain> chains;
  for (std::size_t residue = 0; residue < residues.size(); ++residue) {
    const std::optional<Link> link = link_of(residues, residue);
    if (!link) continue;
    if (chains.empty() || !are_neighbours(residues, chains.back().back(), *link)) chains.emplace_back();
    chains.back().push_back(*link);
  }
  std::erase_if(chains, [](const Chain& chain) { return chain.size() < kMinLinks; });
  return chains;
}

/// Criterion by which a secondary structure (helix or strand) is detected. `distances` [Å] are those from a residue to
/// the second, third and fourth residue after it; `margins` are the tolerances. The structure must have at least
/// `min_links` consecutive residues.
struct Pattern {
  Fold fold;
  std::array<double, 3> distances, margins;
  std::size_t min_links;
};
constexpr std::array<Pattern, 2> kPatterns{
    {{Fold::kHelix, {5.5, 5.3, 6.4}, {0.5, 0.5, 0.6}, 5}, {Fold::kStrand, {6.7, 9.9, 12.4}, {0.6, 0.9, 1.1}, 4}}};

/// Returns true if the distances from residue i match the pattern. Near the end of the chain, only those of the three
/// distances are compared whose residues exist. If the second residue after i does not exist, returns false.
bool fits(const Chain& chain, std::size_t i, const Pattern& pattern) {
  if (i + 2 >= chain.size()) return false;
  for (std::size_t k = 0; k < 3 && i + k + 2 < chain.size(); ++k) {
    const double apart = (chain[i + k + 2].place - chain[i].place).norm();
    if (std::abs(apart - pattern.distances.at(k)) > pattern.margins.at(k)) return false;
  }
  return true;
}

/// Marks each series of consecutive residues that match the pattern, and the two residues after the series. Series of
/// fewer than min_links residues are ignored.
void mark(Chain& chain, const Pattern& pattern) {
  for (std::size_t i = 0; i < chain.size();) {
    std::size_t end = i;
    while (fits(chain, end, pattern)) ++end;
    const std::size_t links = end > i ? end + 2 - i : 0;
    for (std::size_t k = i; links >= pattern.min_links && k < i + links; ++k) {
      if (chain[k].fold == Fold::kCoil) chain[k].fold = pattern.fold;
    }
    i = end + 1;
  }
}

/// Before the call, `across` contains the position of an oxygen atom. It is replaced by the direction of the ribbon's
/// width. Each direction is within 90° of the previous one, so that the ribbon does not flip.
void turn_to_planes(Chain& chain) {
  Vec3 before = Vec3::Zero();
  for (std::size_t i = 0; i < chain.size(); ++i) {
    const std::size_t from = i + 1 < chain.size() ? i : i - 1;
    const Vec3 along = chain[from + 1].place - chain[from].place;
    const Vec3 to_oxygen = chain[i].across - chain[i].place;
    Vec3 across = along.cross(to_oxygen).cross(along);
    if (chain[i].across.isZero() || across.norm() < 1e-6) {
      const std::size_t middle = std::clamp<std::size_t>(i, 1, chain.size() - 2);
      across = along.cross(chain[middle + 1].place - 2 * chain[middle].place + chain[middle - 1].place);
    }
    if (across.norm() < 1e-6) across = before.isZero() ? along.unitOrthogonal() : before;
    across.normalize();
    if (across.dot(before) < 0) across = -across;
    chain[i].across = before = across;
  }
}

/// Smooths the zigzag of strands, so that their ribbon is flat.
void smooth_strands(Chain& chain) {
  const Chain as_was = chain;
  for (std::size_t i = 1; i + 1 < chain.size(); ++i) {
    if (chain[i].fold != Fold::kStrand) continue;
    chain[i].place = (as_was[i - 1].place + 2 * as_was[i].place + as_was[i + 1].place) / 4;
    chain[i].across = (as_was[i - 1].across + as_was[i].across + as_was[i + 1].across).normalized();
  }
}

Size size_of(Fold fold) {
  switch (fold) {
    case Fold::kHelix:
      return kHelixSize;
    case Fold::kStrand:
      return kStrandSize;
    case Fold::kNucleic:
      return kNucleicSize;
    default:
      return kCoilSize;
  }
}

/// Returns half width and half thickness of the cross-section at the fraction `share` of the distance between the links
/// i and i + 1. At the end of a strand, the width decreases such that the ribbon has the form of an arrow.
Size size_at(const Chain& chain, std::size_t i, double share) {
  const Fold here = chain[i].fold, next = chain[std::min(i + 1, chain.size() - 1)].fold;
  const bool ends_next = i + 2 >= chain.size() || chain[i + 2].fold != Fold::kStrand;
  if (here == Fold::kStrand && next == Fold::kStrand && ends_next && share > 0) {
    return {kArrowAngstrom + share * (kCoilSize.x() - kArrowAngstrom), kStrandSize.y()};
  }
  const bool was_arrow = here == Fold::kStrand && next != Fold::kStrand;
  const Size from = was_arrow ? kCoilSize : size_of(here);
  const double smooth = share * share * (3 - 2 * share);
  return from + smooth * (size_of(next) - from);
}

/// Cross-section of a ribbon, with the position and the outward normal of each corner.
struct Section {
  Vec3 middle, along;
  std::vector<std::pair<Vec3, Vec3>> corners;
  Rgba color;
};

/// Returns a point and the tangent of the Catmull-Rom spline between the links i and i + 1; `t` is 0 at link i and 1 at
/// link i + 1. Beyond the ends of the chain, a straight line replaces the spline.
std::pair<Vec3, Vec3> place_and_way(const Chain& chain, std::size_t i, double t) {
  const std::size_t last = chain.size() - 1;
  const Vec3 b = chain[i].place, c = chain[std::min(i + 1, last)].place;
  const Vec3 a = i > 0 ? chain[i - 1].place : Vec3(2 * b - c);
  const Vec3 d = i + 2 <= last ? chain[i + 2].place : Vec3(2 * c - b);
  const Vec3 c1 = (c - a) / 2, c2 = a - 2.5 * b + 2 * c - d / 2, c3 = (d - a) / 2 + 1.5 * (b - c);
  return {b + t * (c1 + t * (c2 + t * c3)), c1 + t * (2 * c2 + t * 3 * c3)};
}

Section section_at(const Chain& chain, std::size_t i, double share, int corners, const Rgba& color) {
  Section section;
  section.color = color;
  const auto [place, way] = place_and_way(chain, i, share);
  const Vec3 towards = (1 - share) * chain[i].across + share * chain[i + 1].across;
  const Vec3 along = way.norm() > 1e-9 ? Vec3(way.normalized()) : towards.unitOrthogonal();
  Vec3 across = towards - towards.dot(along) * along;
  across = across.norm() > 1e-9 ? Vec3(across.normalized()) : along.unitOrthogonal();
  const Vec3 through = along.cross(across);
  const Size size = size_at(chain, i, share);
  section.middle = place;
  section.along = along;
  for (int k = 0; k < corners; ++k) {
    const double angle = 2 * std::numbers::pi * k / corners, c = std::cos(angle), s = std::sin(angle);
    section.corners.emplace_back(place + size.x() * c * across + size.y() * s * through,
                                 (c / size.x() * across + s / size.y() * through).normalized());
  }
  return section;
}

/// Builds the mesh of a ribbon from consecutive cross-sections. The mesh is in metres.
class Ribbon {
 public:
  Ribbon(DrawnMesh& out, double metres_per_angstrom) : out_(out), scale_(metres_per_angstrom) {}

  void append(Section section) {
    if (last_) {
      join(*last_, section);
    } else {
      cap(section, -1);
    }
    last_ = std::move(section);
  }
  void end() {
    if (last_) cap(*last_, 1);
  }

 private:
  void add(const Vec3& place, const Vec3& normal, const Rgba& color) {
    out_.push_back({floats_of(scale_ * place), floats_of(normal), bytes_of(color)});
  }

  void join(const Section& a, const Section& b) {
    for (std::size_t k = 0; k < a.corners.size(); ++k) {
      const std::size_t next = (k + 1) % a.corners.size();
      for (const auto& [section, corner] : {std::pair(&a, k), {&a, next}, {&b, next}, {&a, k}, {&b, next}, {&b, k}}) {
        add(section->corners[corner].first, section->corners[corner].second, a.color);
      }
    }
  }

  /// Closes an end of the ribbon by a flat face.
  /// In      side  1: the end of the chain, where the face points in the direction of the chain; −1: the start of the
  ///               chain, where the face points in the opposite direction
  void cap(const Section& section, double side) {
    const std::size_t corners = section.corners.size();
    for (std::size_t k = 0; k < corners; ++k) {
      const std::size_t next = (k + 1) % corners, first = side > 0 ? k : next, second = side > 0 ? next : k;
      add(section.middle, side * section.along, section.color);
      add(section.corners[first].first, side * section.along, section.color);
      add(section.corners[second].first, side * section.along, section.color);
    }
  }

  DrawnMesh& out_;
  double scale_;
  std::optional<Section> last_;
};

/// Appends a rod for a base of a nucleic acid, from the sugar to the far end of the base.
void append_base(DrawnMesh& out, const Residues& residues, const Link& link, double scale, const Rgba& color) {
  const bool is_purine = residues.atom(link.residue, "N9").has_value();
  if (const auto end = residues.atom(link.residue, is_purine ? "N1" : "N3")) {
    append_stick(out, scale * link.place, scale * residues.place(*end), scale * kBaseAngstrom, kBaseSides, color);
  }
}

/// Appends the atoms that do not belong to a chain, as sticks.
void append_others(DrawnMesh& out, const Molecule& molecule, double scale, std::span<const Rgba> colors,
                   const std::vector<bool>& is_in_chain, const std::stop_token& stop) {
  Molecule others;
  std::vector<Rgba> their_colors;
  for (std::size_t atom = 0; atom < molecule.size(); ++atom) {
    if (is_in_chain[atom]) continue;
    others.positions_angstrom.push_back(molecule.positions_angstrom[atom]);
    others.mass_u.push_back(molecule.mass_u[atom]);
    others.elements.push_back(molecule.elements[atom]);
    their_colors.push_back(colors[atom]);
  }
  append_sticks(out, others, scale, their_colors, stop);
}

}  // namespace

void append_ribbon(DrawnMesh& out, const Molecule& molecule, double metres_per_angstrom, std::span<const Rgba> colors,
                   const std::stop_token& stop) {
  if (molecule.atom_names.size() != molecule.size() || molecule.segments.size() != molecule.size()) {
    return append_sticks(out, molecule, metres_per_angstrom, colors, stop);
  }
  const Residues residues(molecule);
  const auto* const found =
      std::ranges::find_if(kDetails, [&](const Detail& each) { return residues.size() <= each.max_residues; });
  const Detail& detail = found == kDetails.end() ? kDetails.back() : *found;
  std::vector<bool> is_in_chain(molecule.size());
  for (Chain& chain : chains_of(residues)) {
    for (const Link& link : chain) {
      for (std::size_t atom = residues.begin(link.residue); atom < residues.end(link.residue); ++atom)
        is_in_chain[atom] = true;
      if (link.fold == Fold::kNucleic) append_base(out, residues, link, metres_per_angstrom, colors[link.atom]);
    }
    for (const Pattern& pattern : kPatterns) mark(chain, pattern);
    turn_to_planes(chain);
    smooth_strands(chain);
    Ribbon ribbon(out, metres_per_angstrom);
    for (std::size_t i = 0; i + 1 < chain.size() && !stop.stop_requested(); ++i) {
      const bool is_last = i + 2 == chain.size();
      for (int k = 0; k < detail.sections + (is_last ? 1 : 0); ++k) {
        const double share = static_cast<double>(k) / detail.sections;
        ribbon.append(section_at(chain, i, share, detail.corners, colors[chain[share < 0.5 ? i : i + 1].atom]));
      }
    }
    ribbon.end();
  }
  append_others(out, molecule, metres_per_angstrom, colors, is_in_chain, stop);
}

}  // namespace tandem::client
