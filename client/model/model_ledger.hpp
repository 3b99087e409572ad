// Whether a local model makes energy: what it holds, and what came into it from elsewhere than the hand.
#pragma once

#include <cstddef>
#include <vector>

#include "common/physics/world.hpp"

namespace tandem::client {

/// Energies of a local model [J].
struct ModelEnergy {
  double stored_j = 0;      ///< in its tool, the tool's coupling, and the bodies that the model steps itself
  double exchanged_j = 0;   ///< what came with bodies and from the field, less what went; see ModelLedger
  double field_work_j = 0;  ///< the field's part of that
  double corrected_j = 0;   ///< of what stored_j rose by, that of small corrections towards the server
  double joints_j = 0;      ///< held by the joints to the server's bodies, as the model sees them; in none of the above
};

/// Keeps the account for experiments; when it is not kept, every call is a comparison.
///
/// Model   stored     Σ of the bodies that the model steps: ½ m v² + ½ ωᵀ I ω + c m g z + anchor, c the part of the weight
///                    that is borne here; the same of the tool, and what its coupling holds. Joints to the server's
///                    bodies are apart (joints_j): what they do is work at both ends
///         exchanged  + the energy of a body as the server had it, when the model takes it over
///                    − its energy as the model had it, when the model gives it up to follow the server
///                    + the change when a part of its weight goes over to the server's body, or comes back
///                    + the field's work on bodies that the model steps, by the mean of the wrenches at both ends of a
///                      step; corrections move a body in the field too. Bodies that are followed move the field and so
///                      do work through it; this way that is from outside, as it is, and the energy that sampling the
///                      field makes is not: the model's bodies got the wrench of the step's begin
///         A body's first step after a touch is counted with what the touch gave it: it is taken over with the energy
///         that it had where it was followed last.
/// Limits  what is taken over is the server's word, not checked here
/// Thread  of the local model
class ModelLedger {
 public:
  /// In      world  outlives it
  ModelLedger(const physics::World& world, std::size_t tool, bool is_kept)
      : world_(world), tool_(tool), is_kept_(is_kept) {}
  /// A body that the model may step; before the first step. It is known by how many were added before it.
  void add(BodyId id);

  /// About to be stepped here no more; then put where it follows.
  void give_up(std::size_t body) noexcept;
  void follow(std::size_t body) noexcept;
  /// Stepped here from now on; then its joint was set; then it was corrected.
  void take(std::size_t body) noexcept;
  void joined(std::size_t body) noexcept;
  void corrected(std::size_t body) noexcept;
  /// Before and after the tool is corrected.
  void take_tool() noexcept;
  void corrected_tool() noexcept;

  /// Before and after the world's step.
  void begin_step() noexcept;
  void end_step() noexcept;

  /// Zero when it is not kept.
  ModelEnergy energy() const noexcept;

 private:
  struct Entry {
    BodyId id;
    bool is_followed = false;
    double followed_j = 0;     ///< where it was followed last
    double marked_j = 0;       ///< before what is being accounted
    Pose before, now;          ///< at the begin of the last step here, and of this
    Wrench field_W;            ///< at the begin of the last step
    double provisional_j = 0;  ///< the field's work in it, as far as known
    bool has_stepped = false;
  };

  double energy_j(const Entry& entry) const noexcept { return world_.energy_of_body_j(entry.id); }

  const physics::World& world_;
  std::size_t tool_;
  bool is_kept_;
  std::vector<Entry> bodies_;
  double exchanged_j_ = 0;
  double corrected_j_ = 0;
  double field_work_j_ = 0;
  double marked_tool_j_ = 0;
};

}  // namespace tandem::client
