#include "job/traffic/trains.h"

#include <algorithm>

#include "core/parallel.h"
#include "job/traffic/train_spacing.h"

namespace terracast::job {
namespace {

constexpr double kTrainPoints_m = 2.0;
/// Of curves from one track into another.
constexpr double kSwitchRadius_m = 190.0;
constexpr double kTramRadius_m = 25.0;

struct MadeTrain {
  std::unique_ptr<Train> train;  ///< nullptr: there is none
  TrainCourse course;
  Unmade why_not = Unmade::WayEnds;
};

/// sides   of the side on which the proposal's trains keep
MadeTrain make_train(const TrainProposal& proposal, const TrackSides& sides,
                     const TrafficSite& site, double duration_s) {
  const TrafficOptions& options = *proposal.options;
  const DrawnTrain drawn =
      draw_train(rows_on(proposal.rail->kind, options.things), proposal.start.key);
  const double length_m = drawn.length_m();
  const double limit_mps = std::min(
      options.speed * speed_limit_kmph(site.ways.part(proposal.start.arm)) / 3.6, drawn.most_mps);
  // The start is the place of the train's end: its head is on the way for so much longer.
  Start start = proposal.start;
  start.lasts_s += length_m / limit_mps;
  Route route = rail_route(site.ways, sides, start, proposal.lane, options.speed,
                           options.drives_on_left, drawn.most_mps);
  if (route.legs.empty())
    return {.train = nullptr,
            .course = {},
            .why_not = route.is_given_up ? Unmade::GivenUp : Unmade::WayEnds};
  const bool is_tram = proposal.rail->kind == world::WayKind::Tram;
  const double radius_m = is_tram ? kTramRadius_m : kSwitchRadius_m;
  double head_m = proposal.start.along_m + length_m;
  std::vector<PathPoint> path = cut_out(
      lane_path(site.ways, route.legs, {.right_m = radius_m, .left_m = radius_m}, kTrainPoints_m),
      kTrainPoints_m, lasts_s(duration_s), length_m, head_m);
  if (path.size() < 4) return {};
  PathCurve curve(std::move(path));
  if (head_m >= curve.length_m()) return {};
  auto train = std::make_unique<Train>(start.key, options, drawn, std::move(curve),
                                       proposal.rail->style, head_m);
  if (train->lasts_s() < lasts_s(duration_s)) return {};
  if (!train->is_inside(site.half_size_m, duration_s))
    return {.train = nullptr, .course = {}, .why_not = Unmade::LeavesWorld};
  return {.train = std::move(train),
          .course = {.key = start.key,
                     .legs = std::move(route.legs),
                     .end_m = proposal.start.along_m,
                     .length_m = length_m,
                     .room_m = proposal.rail->headway_s * limit_mps}};
}

}  // namespace

std::vector<std::unique_ptr<Train>> make_trains(std::span<const TrainProposal> proposals,
                                                const TrafficSite& site, double duration_s,
                                                Tally& tally) {
  std::vector<MadeTrain> all(proposals.size());
  const TrackSides on_right(site.ways, false), on_left(site.ways, true);
  core::parallel_for(static_cast<std::int64_t>(proposals.size()), [&](std::int64_t i) {
    const auto k = static_cast<std::size_t>(i);
    all[k] = make_train(proposals[k], proposals[k].options->drives_on_left ? on_left : on_right,
                        site, duration_s);
  });
  tally.num_proposed += static_cast<std::int64_t>(all.size());
  for (const MadeTrain& one : all)
    if (!one.train) tally.add(one.why_not);
  std::erase_if(all, [](const MadeTrain& one) { return one.train == nullptr; });
  std::sort(all.begin(), all.end(),
            [](const auto& a, const auto& b) { return a.course.key < b.course.key; });
  all.erase(std::unique(all.begin(), all.end(),
                        [](const auto& a, const auto& b) { return a.course.key == b.course.key; }),
            all.end());
  std::vector<TrainCourse> courses;
  for (MadeTrain& one : all) courses.push_back(std::move(one.course));
  const std::vector<std::uint8_t> gives_way = find_too_near(site.ways, courses);
  std::vector<std::unique_ptr<Train>> trains;
  for (std::size_t k = 0; k < all.size(); ++k) {
    tally.num_giving_way += gives_way[k];
    if (gives_way[k] == 0) trains.push_back(std::move(all[k].train));
  }
  return trains;
}

}  // namespace terracast::job
