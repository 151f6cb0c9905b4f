#include "batch/verify.h"

#include <algorithm>
#include <set>

#include "batch/board.h"
#include "capture/manifest.h"
#include "core/atomic_file.h"
#include "core/random.h"
#include "job/stages.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

constexpr std::uint64_t kStream = 0x766572696679;  // "verify"

struct SampledFrame {
  int run = 0;
  int sequence = 0;
  int frame = 0;
  auto operator<=>(const SampledFrame&) const = default;
};

/// Frames drawn evenly over all of the plan, ascending.
std::set<SampledFrame> draw_frames(const Plan& plan, const VerifyOptions& options) {
  std::set<SampledFrame> drawn;
  const auto num_frames = static_cast<std::uint64_t>(plan.num_frames());
  const std::uint64_t num_wanted =
      std::min(num_frames, static_cast<std::uint64_t>(options.num_samples));
  for (std::int64_t i = 0; drawn.size() < num_wanted; ++i) {
    auto left =
        static_cast<std::int64_t>(core::random_bits(static_cast<std::uint64_t>(options.seed),
                                                    kStream, static_cast<std::uint64_t>(i)) %
                                  num_frames);
    for (std::size_t run = 0; run < plan.runs.size() && left >= 0; ++run) {
      const auto& sequences = plan.runs[run].sequences;
      for (std::size_t s = 0; s < sequences.size() && left >= 0; ++s) {
        if (left < sequences[s].num_frames)
          drawn.insert({static_cast<int>(run), static_cast<int>(s), static_cast<int>(left)});
        left -= sequences[s].num_frames;
      }
    }
  }
  return drawn;
}

/// Whether two captures hold a frame with the same bytes.
bool is_same_frame(const fs::path& a, const fs::path& b, int frame,
                   const std::vector<capture::CameraCalibration>& cameras) {
  std::vector<std::string> files = {capture::record_path(frame)};
  for (const capture::CameraCalibration& camera : cameras) {
    files.push_back(capture::color_path(camera, frame));
    files.push_back(capture::facts_path(camera, frame));
  }
  return std::all_of(files.begin(), files.end(), [&](const std::string& file) {
    std::error_code ignored;
    return fs::exists(a / file, ignored) && core::read_file(a / file) == core::read_file(b / file);
  });
}

void render_sample(const Plan& plan, const JobFolder& folder, const VerifyOptions& options,
                   const core::Context& context, Verification& found) {
  const Description description = Description::load(plan.inputs);
  for (const SampledFrame& sample : draw_frames(plan, options)) {
    const PlannedRun& run = plan.runs[static_cast<std::size_t>(sample.run)];
    const auto& sequence = run.sequences[static_cast<std::size_t>(sample.sequence)];
    const std::string name = fmt::format("{}/{}, frame {}", run.name, sequence.name, sample.frame);
    core::with_context(
        [&] {
          const job::Job job = job::prepare_job(description.run_config(run.index), context);
          const Attempt attempt(folder);
          job::render_sequence(job, job.sequences.at(static_cast<std::size_t>(sample.sequence)),
                               world::TileStore::open(folder.world(
                                   plan.worlds[static_cast<std::size_t>(run.world)], run)),
                               {.first = sample.frame, .end = sample.frame + 1}, attempt.folder(),
                               context);
          found.sampled.push_back(name);
          if (!is_same_frame(folder.captures(run) / sequence.name, attempt.folder(), sample.frame,
                             job.cameras))
            found.differing.push_back(name);
        },
        fmt::format("rendering {} once more", name));
  }
}

/// What is damaged, and all that was made from it, is done no more.
void reopen(const Plan& plan, Claims& claims, Verification& found) {
  std::set<int> exports;
  for (const DamagedFile& file : found.damaged) exports.insert(file.shard.index);
  const auto open = [&](const ShardId& shard) {
    if (!claims.is_done(shard)) return;
    claims.reopen(shard);
    found.reopened.push_back(shard);
  };
  Board board(plan, claims);
  for (const int index : exports) open({Stage::Export, index});
  board.refresh();
  for (const Shard& shard : plan.of(Stage::Validate))
    if (!board.is_ready(shard.id)) open(shard.id);
  if (!found.reopened.empty()) open({Stage::Merge, 0});
}

}  // namespace

Verification verify(const Plan& plan, const JobFolder& folder, const VerifyOptions& options,
                    const core::Context& context) {
  Claims claims(folder.state(), options.claims);
  Board board(plan, claims);
  board.refresh();
  if (!board.is_complete(Stage::Export) || plan.of(Stage::Export).empty())
    fail(ErrorKind::Input, "{}: {} of {} shards are exported; run the batch first",
         folder.root.string(), board.num_done(Stage::Export), plan.of(Stage::Export).size());
  Verification found;
  std::vector<core::FileChecksum> checksums;
  found.damaged = find_damaged(plan, folder, context, checksums);
  found.num_files = static_cast<std::int64_t>(checksums.size());
  render_sample(plan, folder, options, context, found);
  if (options.is_repaired) reopen(plan, claims, found);
  return found;
}

}  // namespace terracast::batch
