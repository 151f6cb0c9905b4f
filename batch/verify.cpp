#include "batch/verify.h"

#include <algorithm>
#include <map>
#include <set>

#include "batch/board.h"
#include "batch/merge.h"
#include "batch/run_files.h"
#include "batch/update.h"
#include "capture/file_check.h"
#include "capture/frame_reader.h"
#include "capture/frame_writer.h"
#include "capture/sequence_files.h"
#include "core/atomic_file.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/random.h"
#include "job/stages.h"
#include "job/traffic/traffic_site.h"
#include "render/checked_plan.h"
#include "world/tile_file.h"
#include "world/tile_store.h"

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

/// Whether two captures hold a frame with the same bytes; its record says what raw files hold.
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

/// The shard that rendered a frame.
ShardId shard_of(const Plan& plan, const SampledFrame& sample) {
  for (const Shard& shard : plan.of(Stage::Render))
    for (const Piece& piece : shard.pieces)
      if (piece.run == sample.run && piece.sequence == sample.sequence &&
          piece.first_frame <= sample.frame && sample.frame < piece.end_frame)
        return shard.id;
  fail(ErrorKind::Internal, "frame {} is in no shard", sample.frame);
}

void render_sample(const Plan& plan, const JobFolder& folder, const VerifyOptions& options,
                   const Claims& claims, const core::Context& context, Verification& found) {
  const Description description = Description::load(plan.inputs);
  for (const SampledFrame& sample : draw_frames(plan, options)) {
    const ShardId shard = shard_of(plan, sample);
    if (!claims.is_done(shard)) continue;
    const PlannedRun& run = plan.runs[static_cast<std::size_t>(sample.run)];
    const auto& sequence = run.sequences[static_cast<std::size_t>(sample.sequence)];
    const std::string name = fmt::format("{}/{}, frame {}", run.name, sequence.name, sample.frame);
    const fs::path world = folder.world(plan.worlds[static_cast<std::size_t>(run.world)], run);
    const fs::path captured = folder.captures(run) / sequence.name;
    std::error_code ignored;
    if (!fs::exists(captured, ignored))
      continue;  // removed to save room; exports stand by themselves
    const capture::FrameSelection frame{.first = sample.frame, .end = sample.frame + 1};
    const Attempt attempt(folder);
    const auto render = [&] {
      const job::RunConfig config = description.run_config(run.index);
      const job::Job job = job::prepare_job(config, context, world);
      check_flight_files(run, plan.worlds[static_cast<std::size_t>(run.world)], config);
      const auto& flight = job.sequences.at(static_cast<std::size_t>(sample.sequence));
      const auto store = world::TileStore::open(world);
      job::render_sequence(job, flight, store, frame, attempt.folder(), context);
      found.sampled.push_back(name);
      if (is_same_frame(captured, attempt.folder(), sample.frame, flight.cameras)) return;
      render::SequencePlan shown = flight;
      job::add_traffic(job, store, context.log, shown);
      const auto damaged =
          capture::find_damaged_frames(captured, render::CheckedPlan(shown, store).info(), frame);
      if (damaged && damaged->empty())
        found.differing.push_back(name);
      else
        found.damaged.push_back({shard, captured.string(),
                                 fmt::format("frame {} or the manifest is damaged", sample.frame)});
    };
    try {
      core::with_context(render, fmt::format("rendering {} once more", name));
    } catch (const core::Error& error) {
      if (!tells_of(error, world) || has_unplanned_edits(run, world)) throw;
      // Their shard keeps whole tiles, and makes damaged ones again.
      for (const Shard& tiles : plan.of(Stage::Tile))
        if (tiles.pieces.front().run == sample.run)
          found.damaged.push_back({tiles.id, world.string(), error.message()});
    }
  }
}

/// What the shards of a stage that are done have put in place.
std::vector<CheckedFolder> done_folders(const Plan& plan, const JobFolder& folder,
                                        const Board& board, Stage stage) {
  std::vector<CheckedFolder> folders;
  for (const Shard& shard : plan.of(stage))
    for (const Piece& piece : shard.pieces)
      if (board.is_done(shard.id)) folders.push_back(checked_folder(plan, folder, shard.id, piece));
  return folders;
}

/// SHA256SUMS of a merged dataset: it lists every exported file as it was exported, and what else it
/// lists is so too.
void check_sums(const JobFolder& folder, const std::vector<core::FileChecksum>& exported,
                const ShardId& merge, Verification& found) {
  const fs::path file = folder.dataset() / kChecksumsFile;
  const auto blame = [&](const fs::path& damaged, const std::string& what) {
    found.damaged.push_back({merge, damaged.string(), what});
  };
  std::map<std::string, std::string> listed;
  try {
    for (core::FileChecksum& checksum : read_checksums(file))
      listed.emplace(std::move(checksum.path), std::move(checksum.sha256));
  } catch (const core::Error& error) {
    if (error.kind() == ErrorKind::Interrupted) throw;
    return blame(file, "is missing, or no list of checksums");
  }
  for (const core::FileChecksum& checksum : exported) {
    const auto entry = listed.find(checksum.path);
    if (entry == listed.end() || entry->second != checksum.sha256)
      return blame(file, fmt::format("does not list {} as it was exported", checksum.path));
    listed.erase(entry);
  }
  for (const auto& [path, sha256] : listed)
    if (const std::string what = damage_of(folder.dataset() / path, sha256); !what.empty())
      blame(folder.dataset() / path, what);
}

/// Records that cannot be read.
void check_records(const Plan& plan, const Claims& claims, const Board& board,
                   Verification& found) {
  for (const Stage stage : kStages)
    for (const Shard& shard : plan.of(stage)) {
      if (!board.is_done(shard.id)) continue;
      try {
        claims.record(shard.id);
      } catch (const core::Error& error) {
        if (error.kind() != ErrorKind::Input) throw;
        found.damaged.push_back(
            {shard.id, claims.record_file(shard.id).string(), "is not as it was written"});
      }
    }
}

/// A frame's files that are not as they were made.
std::vector<fs::path> damaged_files(const std::optional<capture::WholeFrames>& frames,
                                    const fs::path& captured, int frame) {
  if (!frames) return {captured / capture::kSequenceFile};
  const std::optional<capture::FrameRecord> record = frames->record(frame);
  if (!record) return {captured / capture::record_path(frame)};
  std::vector<fs::path> damaged;
  for (const capture::FrameFile* file : record->files())
    if (!capture::is_whole(captured, *file)) damaged.push_back(captured / file->path);
  return damaged;
}

/// Frames, as far as captures were not removed to save room.
void check_captures(const Plan& plan, const JobFolder& folder, const Board& board,
                    const core::Context& context, Verification& found) {
  core::Progress progress(context, "frames", plan.num_frames());
  for (const Shard& shard : plan.of(Stage::Render)) {
    if (!board.is_done(shard.id)) continue;
    for (const Piece& piece : shard.pieces) {
      const PlannedRun& run = plan.runs[static_cast<std::size_t>(piece.run)];
      const fs::path captured =
          folder.captures(run) / run.sequences[static_cast<std::size_t>(piece.sequence)].name;
      std::error_code ignored;
      if (!fs::exists(captured, ignored)) continue;
      const auto frames = capture::WholeFrames::open(captured);
      std::vector<std::vector<fs::path>> damaged(
          static_cast<std::size_t>(piece.end_frame - piece.first_frame));
      core::parallel_for(static_cast<std::int64_t>(damaged.size()), [&](std::int64_t i) {
        damaged[static_cast<std::size_t>(i)] =
            damaged_files(frames, captured, piece.first_frame + static_cast<int>(i));
        progress.advance();
      });
      found.num_frames += static_cast<std::int64_t>(damaged.size());
      std::set<fs::path> named;
      for (const auto& files : damaged)
        for (const fs::path& file : files)
          if (named.insert(file).second)
            found.damaged.push_back({shard.id, file.string(), "is missing, or not as it was made"});
    }
  }
}

/// Tiles, as far as worlds were not removed to save room. One that runs share is read once, and made
/// again by the first of them.
void check_tiles(const Plan& plan, const JobFolder& folder, const Board& board,
                 Verification& found) {
  std::set<fs::path> seen;
  for (const Shard& shard : plan.of(Stage::Tile)) {
    const PlannedRun& run = plan.runs[static_cast<std::size_t>(shard.pieces.front().run)];
    const fs::path world = folder.world(plan.worlds[static_cast<std::size_t>(run.world)], run);
    std::error_code ignored;
    if (!board.is_done(shard.id) || !fs::exists(world / "manifest.json", ignored)) continue;
    try {
      const auto store = world::TileStore::open(world);
      for (const world::TileInfo& tile : store.manifest().tiles) {
        const fs::path file = world::tile_path(world.parent_path(), tile.id);
        if (seen.insert(file).second && !world::inspect_tile(world.parent_path(), tile.id))
          found.damaged.push_back({shard.id, file.string(), "is missing, or not as it was made"});
      }
    } catch (const core::Error& error) {
      if (error.kind() != ErrorKind::Input && error.kind() != ErrorKind::Io) throw;
      found.damaged.push_back({shard.id, (world / "manifest.json").string(), error.message()});
    }
  }
  found.num_tiles = static_cast<std::int64_t>(seen.size());
}

/// Edits that a run is to have, which no shard can make again.
void check_edited_tiles(const Plan& plan, const JobFolder& folder, const Board& board,
                        Verification& found) {
  for (const Shard& shard : plan.of(Stage::Tile)) {
    const PlannedRun& run = plan.runs[static_cast<std::size_t>(shard.pieces.front().run)];
    const fs::path store = folder.world(plan.worlds[static_cast<std::size_t>(run.world)], run);
    std::error_code ignored;
    if (!board.is_done(shard.id) || !fs::exists(store, ignored)) continue;  // removed to save room
    for (const fs::path& tile : lost_edits(run, store))
      found.damaged.push_back({shard.id, tile.string(),
                               "was edited, and is damaged, missing or another than planned; bring "
                               "the edited file back"});
  }
}

/// What is damaged, and all that was made from it, is done no more. What was given up may have been so
/// for the damage.
void reopen(const Plan& plan, Claims& claims, Verification& found) {
  std::set<std::pair<Stage, int>> opened;
  const auto open = [&](const ShardId& shard) {
    if (!opened.emplace(shard.stage, shard.index).second) return;
    if (claims.is_done(shard)) found.reopened.push_back(shard);
    claims.reopen(shard);
  };
  for (const DamagedFile& file : found.damaged) open(file.shard);
  Board board(plan, claims);
  board.refresh();
  for (const Stage stage : {Stage::Validate, Stage::Merge}) {
    for (const Shard& shard : plan.of(stage))
      if (!board.is_ready(shard.id)) open(shard.id);
    board.refresh();
  }
  for (const Claims::Tried& tried : claims.tried())
    if (tried.is_poisoned) open(tried.shard);
}

}  // namespace

Verification verify(const Plan& plan, const JobFolder& folder, const VerifyOptions& options,
                    const core::Context& context) {
  Claims claims(folder.state(), options.claims);
  Board board(plan, claims);
  board.refresh();
  if (board.num_done(Stage::Export) == 0 && !options.is_repaired)
    fail(ErrorKind::Input, "{}: none of {} shards is exported yet; run the batch first",
         folder.root.string(), plan.of(Stage::Export).size());
  Verification found;
  for (const Stage stage : kStages)
    found.num_open += static_cast<std::int64_t>(plan.of(stage).size()) - board.num_done(stage);
  std::vector<core::FileChecksum> checksums;
  const auto check = [&](Stage stage) {
    for (DamagedFile& file :
         find_damaged(done_folders(plan, folder, board, stage), context, checksums))
      found.damaged.push_back(std::move(file));
    found.num_files += static_cast<std::int64_t>(checksums.size());
  };
  check(Stage::Validate);
  check(Stage::Export);
  for (const Shard& shard : plan.of(Stage::Export))
    if (board.is_done(shard.id))
      for (DamagedFile& file : find_damaged_summaries(plan, folder, shard))
        found.damaged.push_back(std::move(file));
  for (const Shard& shard : plan.of(Stage::Merge))
    if (board.is_done(shard.id)) check_sums(folder, checksums, shard.id, found);
  check_records(plan, claims, board, found);
  check_captures(plan, folder, board, context, found);
  check_tiles(plan, folder, board, found);
  check_edited_tiles(plan, folder, board, found);
  render_sample(plan, folder, options, claims, context, found);
  if (options.is_repaired) reopen(plan, claims, found);
  return found;
}

}  // namespace terracast::batch
