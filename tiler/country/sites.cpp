#include "tiler/country/sites.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "tiler/gradient_noise.h"

namespace terracast::tiler::country {
namespace {

constexpr std::uint64_t kStream = 0x7369746573;
constexpr double kFromLakes_m = 120.0;  ///< from a settlement's middle to the shore

struct RankRule {
  Rank rank;
  double km2_each;  ///< of ground to build on, for one more of them
  int most;
  double apart_m;        ///< from others of their rank and above
  double needed_half_m;  ///< of the square that is looked at
  double needed_share;
};
constexpr RankRule kRules[] = {{Rank::City, 1.5, 1, 0.0, 1400.0, 0.55},
                               {Rank::Town, 90.0, 9, 6000.0, 750.0, 0.55},
                               {Rank::Village, 9.0, 90, 1900.0, 260.0, 0.6},
                               {Rank::Hamlet, 4.0, 220, 1000.0, 120.0, 0.6}};

double density_per_km2(Rank rank) {
  return rank == Rank::City      ? 4200.0
         : rank == Rank::Town    ? 3000.0
         : rank == Rank::Village ? 1500.0
                                 : 700.0;
}

}  // namespace

BuildableShare::BuildableShare(const PlanGround& ground, double steepest) : ground_(ground) {
  const int side = ground.side();
  sums_ = Grid<std::int32_t>(side + 1, side + 1);
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const Point at = ground.place(i, j);
      const bool is_good = ground.is_sea()(i, j) == 0 && ground.slope(at) < steepest;
      sums_(i + 1, j + 1) = (is_good ? 1 : 0) + sums_(i, j + 1) + sums_(i + 1, j) - sums_(i, j);
    }
  total_km2_ = sums_(side, side) * ground.spacing_m() * ground.spacing_m() * 1e-6;
}

double BuildableShare::at(const Point& center, double half_side_m) const {
  const int reach = std::max(static_cast<int>(half_side_m / ground_.spacing_m()), 1);
  const Point node = ground_.node_of(center);
  const int i = static_cast<int>(std::round(node.x()));
  const int j = static_cast<int>(std::round(node.y()));
  const auto clamp = [&](int k) { return std::clamp(k, 0, ground_.side()); };
  const int i0 = clamp(i - reach), i1 = clamp(i + reach + 1);
  const int j0 = clamp(j - reach), j1 = clamp(j + reach + 1);
  const double count = sums_(i1, j1) - sums_(i0, j1) - sums_(i1, j0) + sums_(i0, j0);
  return count / ((2.0 * reach + 1.0) * (2.0 * reach + 1.0));
}

std::vector<Settlement> choose_sites(const PlanGround& ground, const Occupancy& occupancy,
                                     std::uint64_t seed) {
  const BuildableShare buildable(ground);
  const GradientNoise luck(seed, kStream);
  const double river_cells = 8e6 / (ground.spacing_m() * ground.spacing_m());
  // Candidates once, with what does not depend on the rank.
  struct Candidate {
    Point at;
    double pull;  ///< of water, low ground and chance
    bool is_coastal;
  };
  std::vector<Candidate> candidates;
  const int stride = std::max(static_cast<int>(128.0 / ground.spacing_m()), 1);
  for (int j = 0; j < ground.side(); j += stride)
    for (int i = 0; i < ground.side(); i += stride) {
      const Point at = ground.place(i, j);
      if (ground.is_sea()(i, j) != 0 || ground.slope(at) > 0.16) continue;
      const double sea_m = ground.sea_distance_m(at);
      if (sea_m < 70.0 || !occupancy.is_free(at, kFromLakes_m, kLake)) continue;
      double largest_river = 0.0;
      for (int dj = -8; dj <= 8; dj += 2)
        for (int di = -8; di <= 8; di += 2)
          if (ground.heights_m().contains(i + di, j + dj))
            largest_river = std::max(
                largest_river,
                static_cast<double>(ground.flow().area[ground.heights_m().index(i + di, j + dj)]));
      const double river = std::clamp(largest_river / (8.0 * river_cells), 0.0, 1.0);
      const double coast = std::clamp(1.0 - (sea_m - 150.0) / 900.0, 0.0, 1.0);
      const double noise = fractal_noise(luck, at.x() / 3000.0, at.y() / 3000.0, 4);
      candidates.push_back(
          {at, 0.25 * river + 0.4 * coast - 0.9 * ground.slope(at) + 0.5 * noise, sea_m < 900.0});
    }

  std::vector<Settlement> settlements;
  for (const RankRule& rule : kRules) {
    const int wanted =
        std::min(static_cast<int>(std::ceil(buildable.total_km2() / rule.km2_each)), rule.most);
    if (rule.rank != Rank::City && settlements.empty()) break;
    struct Scored {
      double score;
      std::size_t candidate;
    };
    std::vector<Scored> scored;
    const double border_m = std::min(2.2 * rule.needed_half_m, 0.25 * ground.half_size_m());
    for (std::size_t k = 0; k < candidates.size(); ++k) {
      const Candidate& candidate = candidates[k];
      if (!ground.is_in_square(candidate.at, border_m)) continue;
      const double share = buildable.at(candidate.at, rule.needed_half_m);
      // A land of mountains has its city too, on less.
      const double least = rule.rank == Rank::City ? 0.25 : rule.needed_share;
      if (share < least) continue;
      double score = candidate.pull + 1.2 * std::min(share / 0.85, 1.0);
      if (rule.rank == Rank::City)
        score += 1.5 * std::min(share, 0.8) - 0.5 * candidate.at.norm() / ground.half_size_m();
      scored.push_back({std::round(score * 4096.0), k});
    }
    std::stable_sort(scored.begin(), scored.end(),
                     [](const Scored& a, const Scored& b) { return a.score > b.score; });
    int count = 0;
    for (const Scored& place : scored) {
      if (count >= wanted) break;
      const Candidate& candidate = candidates[place.candidate];
      const bool is_apart =
          std::none_of(settlements.begin(), settlements.end(), [&](const auto& other) {
            const double apart_m = std::max(rule.apart_m, other.radius_m + 0.55 * rule.apart_m);
            return (other.center - candidate.at).norm() < apart_m;
          });
      if (!is_apart) continue;
      Settlement settlement;
      settlement.rank = rule.rank;
      settlement.center = snapped(candidate.at);
      settlement.is_coastal = candidate.is_coastal;
      ++count;
      const double largest = std::min(2000.0 * std::sqrt(buildable.total_km2()), 85000.0);
      const double luck_of = core::random_between(0.75, 1.3, seed, kStream, place.candidate);
      switch (rule.rank) {
        case Rank::City:
          settlement.population = largest;
          break;
        case Rank::Town:
          settlement.population = std::max(luck_of * 0.42 * largest / (1.0 + 0.75 * count), 900.0);
          break;
        case Rank::Village:
          settlement.population = std::max(luck_of * 3000.0 / (1.0 + 0.11 * count), 220.0);
          break;
        case Rank::Hamlet:
          settlement.population = 60.0 * luck_of * luck_of;
          break;
      }
      settlement.radius_m =
          std::sqrt(settlement.population / density_per_km2(rule.rank) / 3.14159) * 1000.0;
      if (rule.rank == Rank::City)
        settlement.radius_m = std::min(settlement.radius_m, 0.6 * ground.half_size_m());
      settlement.palette =
          static_cast<int>(core::random_bits(seed, kStream + 1, place.candidate) % 4);
      settlements.push_back(settlement);
    }
  }
  return settlements;
}

}  // namespace terracast::tiler::country
