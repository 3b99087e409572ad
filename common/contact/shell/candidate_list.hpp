// List of the candidates that a search step finds. It counts the contacts that the candidates need, and limits the
// count. A candidate is a point, several merged points, or a flat node (see shell_candidate.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/contact/shell/leaf_samples.hpp"
#include "common/contact/shell/shell_candidate.hpp"

namespace tandem::contact {

/// Candidates of one search step, in the order of the shell's points. The contacts that all candidates need together
/// are limited by the capacity.
///
/// Thread  any, one at a time; no allocation after construction
class CandidateList {
 public:
  /// In      capacity  largest capacity of bind()
  explicit CandidateList(std::uint32_t capacity);

  /// In      capacity  limit of the number of contacts that the candidates need; values below 2 count as 2
  void bind(const PointShell& shell, std::uint32_t capacity) noexcept;
  void clear() noexcept;

  /// Adds the points of a leaf that are nearer than the band. Returns false if their contacts would exceed the
  /// capacity.
  ///
  /// In      is_fine  true: each near point is a separate candidate
  ///         must     used only if is_fine is false; true: the points are merged in any case, even if this reduces
  ///         their force
  bool add(const LeafSamples& leaf, double band_m, bool is_fine, double rigid_depth_m, bool must) noexcept;
  /// Adds a flat node that lies over `planes`, flat faces of the other shape. Returns false if its contacts would
  /// exceed the capacity.
  bool add_planes(std::uint32_t node, PlaneSet planes) noexcept;
  /// Removes the candidates that represent points of a node, so that the caller can add the whole node as one
  /// candidate. If the node's contacts would exceed the capacity, removes nothing and returns false.
  bool remove_points_of(std::uint32_t node, bool is_fine) noexcept;

  std::span<const ShellCandidate> all() const { return candidates_; }
  std::uint32_t largest_capacity() const { return largest_capacity_; }
  std::uint32_t capacity() const { return capacity_; }
  std::size_t contacts() const { return contacts_; }
  void restore_contacts(std::size_t contacts) noexcept { contacts_ = contacts; }
  std::size_t more_contacts() const { return more_contacts_; }
  std::size_t near_count() const { return near_count_; }

 private:
  std::size_t more_contacts_of(std::uint32_t node, PlaneSet planes) const;

  const PointShell* shell_ = nullptr;
  std::uint32_t largest_capacity_ = 0;
  std::uint32_t capacity_ = 0;
  std::vector<ShellCandidate> candidates_;
  std::size_t contacts_ = 0;  ///< number of contacts that the candidates need; at most capacity_
  /// Additional contacts of the nodes above several planes: one set for each plane after the first. Not included in
  /// contacts_.
  std::size_t more_contacts_ = 0;
  std::size_t near_count_ = 0;  ///< estimated number of near points; a flat node counts as many as its contacts
};

}  // namespace tandem::contact
