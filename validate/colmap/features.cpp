#include "validate/colmap/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "core/atomic_file.h"
#include "core/hash.h"

namespace terracast::validate {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kImagesAStep = 64;
constexpr std::size_t kPairsAStep = 400;

ColmapCommand feature_command() {
  return {"feature_extractor",
          {"--SiftExtraction.use_gpu", "0",
           // Three times COLMAP's own: a third of the features remain, those that are found best,
           // and matching takes a fifth of the time.
           "--SiftExtraction.peak_threshold", "0.02"}};
}

ColmapCommand match_command() {
  return {"matches_importer", {"--match_type", "pairs", "--SiftMatching.use_gpu", "0"}};
}

/// What two images share.
struct Shared {
  int num_points = 0;
  double num_wide = 0.0;  ///< points, each by how well its angle triangulates, 0 to 1
};

/// How well the angle between two rays triangulates: fully from 8 degrees on, and from 12 degrees on less and less, up
/// to where SIFT no longer knows the place again.
double use_of_angle(double angle_rad) {
  constexpr double kFull_rad = radians_from_degrees(8.0);
  constexpr double kLess_rad = radians_from_degrees(12.0);
  constexpr double kMost_rad = radians_from_degrees(30.0);
  const double known_again = (kMost_rad - angle_rad) / (kMost_rad - kLess_rad);
  return std::clamp(std::min(angle_rad / kFull_rad, known_again), 0.0, 1.0);
}

using Pair = std::pair<std::size_t, std::size_t>;

std::map<Pair, Shared> shared_points(const ColmapJob& job) {
  // A point is compared in each image with the next so many that see it: a track of thousands
  // would else take the square of that.
  constexpr std::size_t kMostPartners = 64;
  std::map<Pair, Shared> shared;
  for (const auto& [id, point] : job.sequence.binary_model->points) {
    const Eigen::Vector3d position(point.position[0], point.position[1], point.position[2]);
    std::vector<const Shot*> seen_by;
    for (const auto& [image_id, index] : point.track)
      if (const Shot* const shot = job.find(image_id)) seen_by.push_back(shot);
    std::sort(seen_by.begin(), seen_by.end());
    seen_by.erase(std::unique(seen_by.begin(), seen_by.end()), seen_by.end());
    for (std::size_t i = 0; i < seen_by.size(); ++i) {
      const std::size_t end = std::min(seen_by.size(), i + 1 + kMostPartners);
      for (std::size_t k = i + 1; k < end; ++k) {
        const Eigen::Vector3d a = position - seen_by[i]->local_from_camera.translation;
        const Eigen::Vector3d b = position - seen_by[k]->local_from_camera.translation;
        Shared& both = shared[{static_cast<std::size_t>(seen_by[i] - job.shots.data()),
                               static_cast<std::size_t>(seen_by[k] - job.shots.data())}];
        ++both.num_points;
        both.num_wide += use_of_angle(std::atan2(a.cross(b).norm(), a.dot(b)));
      }
    }
  }
  return shared;
}

std::string lines_of(const std::vector<std::string>& lines) {
  return fmt::format("{}\n", fmt::join(lines, "\n"));
}

/// Cuts lines into a step each `size` of them, with what runs on the step's lines.
template <class Run>
void add_steps(std::vector<WorkFolder::Step>& steps, const std::string& what,
               const std::vector<std::string>& lines, std::size_t size, Run run) {
  for (std::size_t begin = 0; begin < lines.size(); begin += size) {
    const std::vector<std::string> part(
        lines.begin() + static_cast<std::ptrdiff_t>(begin),
        lines.begin() + static_cast<std::ptrdiff_t>(std::min(lines.size(), begin + size)));
    steps.push_back({.key = what + lines_of(part), .grow = [=](const fs::path& folder) {
                       core::write_file(folder / "list.txt", lines_of(part));
                       run(folder, part.size());
                     }});
  }
}

}  // namespace

std::vector<Pair> covisible_pairs(const ColmapJob& job) {
  constexpr int kLeastPoints = 10;
  constexpr std::size_t kMostShared = 2;
  constexpr std::size_t kMostWide = 4;
  constexpr std::size_t kMostOwn = 2;
  struct Partner {
    Pair pair;
    Shared shared;
  };
  std::map<std::size_t, std::vector<Partner>> partners;
  for (const auto& [pair, shared] : shared_points(job)) {
    if (shared.num_points < kLeastPoints) continue;
    partners[pair.first].push_back({pair, shared});
    partners[pair.second].push_back({pair, shared});
  }
  std::set<Pair> chosen;
  for (auto& partners_of_image : partners) {
    std::vector<Partner>& list = partners_of_image.second;
    const auto take_best = [&chosen, &list](std::size_t count, auto score) {
      std::stable_sort(list.begin(), list.end(),
                       [&](const Partner& a, const Partner& b) { return score(a) > score(b); });
      for (std::size_t i = 0; i < std::min(count, list.size()) && score(list[i]) > 0.0; ++i)
        chosen.insert(list[i].pair);
    };
    const auto is_of_one_camera = [&job](const Pair& pair) {
      return job.shots[pair.first].camera_index == job.shots[pair.second].camera_index;
    };
    take_best(kMostShared, [](const Partner& one) { return 1.0 * one.shared.num_points; });
    take_best(kMostWide, [](const Partner& one) { return one.shared.num_wide; });
    // What another camera sees may look too unlike to be matched, however much of it is shared.
    take_best(kMostOwn, [&](const Partner& one) {
      return is_of_one_camera(one.pair) ? 1.0 * one.shared.num_points : 0.0;
    });
  }
  return {chosen.begin(), chosen.end()};
}

std::string files_key(const std::vector<fs::path>& files) {
  std::string key;
  for (const fs::path& file : files) key += core::content_hash_of_file(file) + "\n";
  return key;
}

MatchedDatabase matched_database(const ColmapJob& job) {
  const fs::path exported = job.folder() / "database.db";
  std::vector<fs::path> sources{exported};
  std::vector<std::string> names;
  for (const Shot& shot : job.shots) {
    names.push_back(shot.name);
    sources.push_back(job.images() / shot.name);
  }
  for (const fs::path& source : sources)
    if (!fs::is_regular_file(source))
      throw ColmapFailure(
          fmt::format("{} is missing", source.lexically_relative(job.folder()).string()));
  std::vector<std::string> pairs;
  for (const auto& [a, b] : covisible_pairs(job)) pairs.push_back(names[a] + " " + names[b]);
  if (pairs.empty()) throw ColmapFailure(kNoPairs);

  std::vector<WorkFolder::Step> steps;
  steps.push_back({.key = job.program.version() + "\n" + files_key(sources),
                   .grow = [&](const fs::path& folder) {
                     fs::copy_file(exported, folder / "database.db");
                     // A dataset may be read-only; COLMAP writes into its copy.
                     fs::permissions(folder / "database.db", fs::perms::owner_write,
                                     fs::perm_options::add);
                   }});
  const std::string images = job.images().string();
  const std::string threads = std::to_string(job.num_threads);
  add_steps(steps, feature_command().key(), names, kImagesAStep,
            [&job, images, threads](const fs::path& folder, std::size_t num_images) {
              job.program.run(feature_command(),
                              {"--database_path", (folder / "database.db").string(), "--image_path",
                               images, "--image_list_path", (folder / "list.txt").string(),
                               "--SiftExtraction.num_threads", threads},
                              "features.log", 120.0 + 60.0 * static_cast<double>(num_images));
            });
  add_steps(steps, match_command().key(), pairs, kPairsAStep,
            [&job, threads](const fs::path& folder, std::size_t num_pairs) {
              job.program.run(
                  match_command(),
                  {"--database_path", (folder / "database.db").string(), "--match_list_path",
                   (folder / "list.txt").string(), "--SiftMatching.num_threads", threads},
                  "matches.log", 120.0 + 60.0 * static_cast<double>(num_pairs));
            });
  std::string key;
  for (const WorkFolder::Step& step : steps) key += step.key;
  job.log.info("colmap: features of {} images, matches of {} pairs", names.size(), pairs.size());
  return {.file = job.work.grown("database", steps) / "database.db",
          .key = key,
          .num_pairs = pairs.size()};
}

ColmapModel read_made_model(const fs::path& folder, MayBeEmpty may_be_empty) {
  Findings damage;
  ColmapModel model = read_colmap_binary(folder, "model", damage, ColmapFiles::WithoutRigs);
  if (damage.count() > 0)
    throw ColmapFailure(fmt::format("COLMAP's model cannot be read: {}", damage.lines(1).front()));
  if (may_be_empty == MayBeEmpty::No && (model.images.empty() || model.points.empty()))
    throw ColmapFailure("COLMAP's model is empty");
  return model;
}

}  // namespace terracast::validate
