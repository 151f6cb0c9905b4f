#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "validate/check.h"
#include "validate/checks/checker.h"
#include "validate/oracle_pixels.h"

namespace terracast::validate {

/// Verdicts on one thing, of several places.
struct Verdicts {
  std::int64_t num_judged = 0;
  std::int64_t num_wrong = 0;
  std::int64_t num_ties = 0;
  std::string first;

  void add(const Verdicts& other) {
    num_judged += other.num_judged;
    num_wrong += other.num_wrong;
    num_ties += other.num_ties;
    if (first.empty()) first = other.first;
  }
  void wrong(const std::string& where) {
    if (++num_wrong == 1) first = where;
  }
};

/// Pixels of a camera's newest frame, with what they hit.
struct Sampled {
  OracleView view;
  OraclePixels chosen;
};

/// What a dataset claims of visibility, against exact rays: masks of flow, and points that images see or do not.
/// threads   one object a thread; it uses several itself
class OracleClaims {
 public:
  explicit OracleClaims(const ValidateOptions& options) : options_(options) {}

  /// The ground, and where the dataset's local frame lies in it. Before all others.
  void begin(const oracle::ExactWorld& terrain, const Pose& world_from_local) {
    terrain_ = &terrain;
    world_from_local_ = world_from_local;
  }
  /// The masks of flow between the last frame and this one, of each camera.
  void look_at_flow(const FrameWindow& window, const std::vector<std::optional<Sampled>>& last,
                    const std::vector<std::optional<Sampled>>& sampled);
  /// COLMAP's observations in an image: those that are there, and points that have none.
  void look_at_tracks(const Sequence& sequence, const OracleView& by);
  CheckResult result() const;

 private:
  void judge(const OracleView& by, const Eigen::Vector3d& point_world, bool says_seen,
             const std::string& where, Verdicts& verdicts) const;
  void look_at_mask(const Sampled& from, const OracleView& by, const core::Image8& mask,
                    const core::ImageF& flow);
  Eigen::Vector3d place_of_point(const ColmapModel& model, std::int64_t point) const;
  struct Claim {
    std::int64_t point;
    bool is_seen;
  };
  std::vector<Claim> draw_claims(const ColmapModel& model, const OracleView& by,
                                 const std::vector<std::int64_t>& seen) const;
  void judge_claim(const ColmapModel& model, const OracleView& by, const Claim& claim,
                   Verdicts& verdicts) const;

  ValidateOptions options_;
  const oracle::ExactWorld* terrain_ = nullptr;
  Pose world_from_local_;
  Verdicts visibility_;
  bool has_visibility_ = false;
  std::map<std::string, std::int64_t> image_of_name_;
  std::vector<std::int64_t> point_ids_;
};

}  // namespace terracast::validate
