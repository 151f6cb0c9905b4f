#include "validate/oracle_claims.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel.h"
#include "core/random.h"
#include "validate/null_distribution.h"
#include "validate/oracle_sight.h"

namespace terracast::validate {
namespace {

/// Share of the judged points that are such ties at most, in the mean; few points may have more by chance.
constexpr double kMostTies = 1e-2;
/// A projection nearer to the border of an image is in it or not by rounding.
constexpr double kBorder_px = 1e-4;

/// Judges each of some claims, in parallel: one(i, verdicts).
template <class Judge>
void judge_all(std::size_t count, Verdicts& sum, const Judge& one) {
  std::vector<Verdicts> parts(count);
  constexpr std::int64_t kGrain = 8;
  core::parallel_for_blocks(
      static_cast<std::int64_t>(count), kGrain, [&](std::int64_t begin, std::int64_t end) {
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
          one(i, parts[i]);
      });
  for (const Verdicts& part : parts) sum.add(part);
}

}  // namespace

/// Judges a claim that a point is seen in an image.
/// where   of the point, for messages
void OracleClaims::judge(const OracleView& by, const Eigen::Vector3d& point_world, bool says_seen,
                         const std::string& where, Verdicts& verdicts) const {
  const std::optional<OracleView::Sighting> seen = by.sighting(point_world);
  const Intrinsics& camera = by.intrinsics();
  if (seen && camera.contains(seen->pixel, -kBorder_px) &&
      !camera.contains(seen->pixel, kBorder_px))
    return;
  const bool is_in_image = seen && camera.contains(seen->pixel);
  // What moves may hide it.
  if (is_in_image && !says_seen && by.view.image->shows_moving_near(seen->pixel)) return;
  ++verdicts.num_judged;
  const Sight sight(*terrain_, seen ? seen->eye_world : by.world_from_camera.translation,
                    point_world);
  const bool is_seen = is_in_image && sight.is_seen();
  if (is_seen == says_seen) return;
  if (is_in_image && sight.is_tie()) {
    ++verdicts.num_ties;
    return;
  }
  verdicts.wrong(fmt::format("{}: {} {}, where {}", where,
                             says_seen ? "claimed to be seen by" : "not claimed to be seen by",
                             place_of(by.view),
                             !is_in_image ? "it is outside the image"
                             : is_seen    ? "nothing is between"
                                          : "ground is between"));
}

void OracleClaims::look_at_flow(const FrameWindow& window,
                                const std::vector<std::optional<Sampled>>& last,
                                const std::vector<std::optional<Sampled>>& sampled) {
  for (std::size_t camera = 0; camera < std::min(sampled.size(), last.size()); ++camera) {
    const std::optional<View> before = window.view(static_cast<int>(camera), window.frame() - 1);
    if (!sampled[camera] || !last[camera] || !before || !before->image->flow) continue;
    has_visibility_ = true;
    const FlowFields& flow = *before->image->flow;
    look_at_mask(*last[camera], sampled[camera]->view, flow.covisible_forward, flow.forward);
    if (!flow.covisible_backward.empty())
      look_at_mask(*sampled[camera], last[camera]->view, flow.covisible_backward, flow.backward);
  }
}

/// Of flow that is longer than its format holds (NaN) the mask says nothing.
void OracleClaims::look_at_mask(const Sampled& from, const OracleView& by, const core::Image8& mask,
                                const core::ImageF& flow) {
  const std::vector<OraclePixel>& pixels = from.chosen.pixels;
  judge_all(pixels.size(), visibility_, [&](std::size_t i, Verdicts& verdicts) {
    const OraclePixel& pixel = pixels[i];
    if (pixel.is_on_silhouette || std::isnan(flow(pixel.x, pixel.y, 0)) ||
        from.view.view.image->body_at(pixel.x, pixel.y) != 0)
      return;
    const bool says_seen = mask(pixel.x, pixel.y) != 0;
    const std::string where = place_of(from.view.view, pixel.x, pixel.y);
    if (pixel.hit) {
      judge(by, pixel.hit->point_world, says_seen, where, verdicts);
      return;
    }
    ++verdicts.num_judged;
    if (says_seen) verdicts.wrong(where + ": sky is claimed to be seen");
  });
}

Eigen::Vector3d OracleClaims::place_of_point(const ColmapModel& model, std::int64_t point) const {
  const std::array<double, 3>& p = model.points.at(point).position;
  return world_from_local_ * Eigen::Vector3d(p[0], p[1], p[2]);
}

void OracleClaims::look_at_tracks(const Sequence& sequence, const OracleView& by) {
  if (!sequence.binary_model || sequence.binary_model->points.empty()) return;
  const ColmapModel& model = *sequence.binary_model;
  if (image_of_name_.empty()) {
    for (const auto& [id, image] : model.images) image_of_name_[image.name] = id;
    for (const auto& [id, point] : model.points) point_ids_.push_back(id);
  }
  const auto id =
      image_of_name_.find(by.view.camera->name + "/" + frame_digits(by.view.frame) + ".png");
  if (id == image_of_name_.end()) return;
  has_visibility_ = true;
  std::vector<std::int64_t> seen;
  for (const ColmapObservation& observation : model.images.at(id->second).observations)
    if (model.points.contains(observation.point_id)) seen.push_back(observation.point_id);
  std::sort(seen.begin(), seen.end());
  const std::vector<Claim> claims = draw_claims(model, by, seen);
  judge_all(claims.size(), visibility_, [&](std::size_t i, Verdicts& verdicts) {
    judge_claim(model, by, claims[i], verdicts);
  });
}

/// Of points that an image sees, and of those that it has in its field of view but does not claim, half each.
/// seen   in order
std::vector<OracleClaims::Claim> OracleClaims::draw_claims(
    const ColmapModel& model, const OracleView& by, const std::vector<std::int64_t>& seen) const {
  const std::uint64_t stream =
      core::stream_of(core::stream_of(1ULL << 45, static_cast<std::uint64_t>(by.view.camera_index)),
                      static_cast<std::uint64_t>(by.view.frame));
  std::uint64_t num_drawn = 0;
  const auto draw = [&](const std::vector<std::int64_t>& from) {
    return from[core::random_bits(static_cast<std::uint64_t>(options_.seed), stream, num_drawn++) %
                from.size()];
  };
  std::vector<Claim> claims;
  const auto half = static_cast<std::size_t>((options_.oracle_samples + 1) / 2);
  for (std::size_t i = 0; i < half && !seen.empty(); ++i) claims.push_back({draw(seen), true});
  constexpr std::size_t kTries = 8;
  std::size_t num_unseen = 0;
  for (std::size_t i = 0; i < kTries * half && num_unseen < half; ++i) {
    const std::int64_t point = draw(point_ids_);
    if (std::binary_search(seen.begin(), seen.end(), point)) continue;
    const auto pixel = by.project(place_of_point(model, point));
    if (!pixel || !by.intrinsics().contains(*pixel)) continue;
    claims.push_back({point, false});
    ++num_unseen;
  }
  return claims;
}

void OracleClaims::judge_claim(const ColmapModel& model, const OracleView& by, const Claim& claim,
                               Verdicts& verdicts) const {
  const Eigen::Vector3d point = place_of_point(model, claim.point);
  const std::string where = fmt::format("point {}", claim.point);
  judge(by, point, claim.is_seen, where, verdicts);
  if (!claim.is_seen || verdicts.num_wrong > 0 || verdicts.num_ties > 0) return;
  const std::optional<OracleView::Sighting> sighting = by.sighting(point);
  if (!sighting) return;  // judged above
  const double distance_m = Sight(*terrain_, sighting->eye_world, point).distance_from_ground_m();
  if (distance_m > Sight::kTie_m)
    verdicts.wrong(fmt::format("{}: {:.3g} m from the ground that {} sees there", where, distance_m,
                               place_of(by.view)));
}

CheckResult OracleClaims::result() const {
  if (!has_visibility_)
    return skipped_result("oracle_occlusion",
                          "the dataset claims nothing of visibility that is read");
  if (visibility_.num_judged == 0)
    return unseen_result("oracle_occlusion", "no claim of visibility was sampled");
  CheckResult result;
  result.name = "oracle_occlusion";
  const std::int64_t most_ties =
      binomial_quantile(kFalseVerdict, visibility_.num_judged, kMostTies);
  result.value = static_cast<double>(visibility_.num_wrong +
                                     std::max<std::int64_t>(0, visibility_.num_ties - most_ties));
  result.unit = "points";
  result.ok = result.value == 0.0;
  result.worst = visibility_.first;
  result.summary = fmt::format(
      "Points of {} that are claimed to be seen from another image and are not, or are and are "
      "not claimed, by an exact ray. {} more would change with a camera or point moved by 1e-6 "
      "m, and count as ties.",
      visibility_.num_judged, visibility_.num_ties);
  result.reason =
      "A point is seen or hidden by exact rays. Decimals of poses move a camera by half a "
      "micrometre at most. Views that graze the ground have ties: they count where more are found "
      "than a share of one in 100 gives with a probability of 1e-9.";
  result.detects = "one inverted mask; a point 3 µm off the ground";
  return result;
}

}  // namespace terracast::validate
