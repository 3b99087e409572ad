// Candidates that a step of the search finds, and the number of contacts that they need.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/contact/shell/leaf_samples.hpp"
#include "common/contact/shell/shell_candidate.hpp"

namespace tandem::contact {

/// Candidates of a step in the order of the shell. The number of contacts that they need together is limited.
///
/// Thread  one at a time; no allocation after construction
class CandidateList {
 public:
  /// In      capacity  largest capacity of bind()
  explicit CandidateList(std::uint32_t capacity);

  /// In      capacity  limit of the number of contacts that the candidates need; values below 2 count as 2
  void bind(const PointShell& shell, std::uint32_t capacity) noexcept;
  void clear() noexcept;

  /// Adds the near points of a leaf. Returns false if there is no room for their contacts.
  ///
  /// In      is_fine  true: each near point is a separate candidate
  ///         must     if not is_fine: true: points are merged even if force is lost
  bool add(const LeafSamples& leaf, double band_m, bool is_fine, double rigid_depth_m, bool must) noexcept;
  /// Adds a node above planes. Returns false if there is no room for its contacts.
  bool add_planes(std::uint32_t node, PlaneSet planes) noexcept;
  /// Removes the candidates of a node's points, so that the node can be added instead. Returns false, and removes
  /// nothing, if there is no room for the node's contacts.
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
  std::size_t contacts_ = 0;       ///< number of contacts that the candidates need; at most capacity_
  std::size_t more_contacts_ = 0;  ///< contacts for a node's further planes; they are added if there is room
  std::size_t near_count_ = 0;     ///< estimated number of near points; a node above planes counts as its contacts
};

}  // namespace tandem::contact
