#include "batch/shard_work.h"

#include <algorithm>
#include <map>
#include <optional>

#include "batch/checksums.h"
#include "batch/dataset/sequence_summary.h"
#include "batch/merge.h"
#include "batch/run_files.h"
#include "batch/update.h"
#include "core/atomic_file.h"
#include "job/stages.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

/// A capture whose manifest and frames are damaged needs a manifest before its frames can be judged.
constexpr int kMostMended = 2;

double bytes_in(const fs::path& folder) {
  double bytes = 0.0;
  std::error_code missing;
  for (const auto& entry : fs::recursive_directory_iterator(folder, missing)) {
    std::error_code gone;
    if (entry.is_regular_file(gone)) bytes += static_cast<double>(entry.file_size(gone));
  }
  return bytes;
}

/// A number that frames' names begin with.
double bytes_of_frames(const fs::path& sequence, int first_frame, int end_frame) {
  double bytes = 0.0;
  std::error_code missing;
  for (const auto& entry : fs::recursive_directory_iterator(sequence, missing)) {
    const std::string name = entry.path().filename().string();
    if (name.size() < 6 || name.find_first_not_of("0123456789") < 6) continue;
    const int frame = std::stoi(name.substr(0, 6));
    std::error_code gone;
    if (frame >= first_frame && frame < end_frame && entry.is_regular_file(gone))
      bytes += static_cast<double>(entry.file_size(gone));
  }
  return bytes;
}

}  // namespace

struct ShardWork::Impl {
  const Plan& plan;
  JobFolder folder;
  core::Context context;
  Description description;

  // The run and the world that were worked on last.
  std::optional<int> job_run;
  std::optional<job::Job> opened_job;
  std::string ground_world;
  std::shared_ptr<const tiler::WorldSurface> ground;
  std::shared_ptr<const tiler::WorldSurface> surface;  ///< of the same world, once it was laid out
  std::optional<int> store_run;
  std::optional<world::TileStore> opened_store;

  Impl(const Plan& plan_of_job, JobFolder job_folder, const core::Context& worker_context)
      : plan(plan_of_job),
        folder(std::move(job_folder)),
        context(worker_context),
        description(Description::load(plan.inputs)) {}

  const PlannedRun& run_of(int run) const { return plan.runs[static_cast<std::size_t>(run)]; }
  const std::string& world_of(int run) const {
    return plan.worlds[static_cast<std::size_t>(run_of(run).world)];
  }
  job::RunConfig config_of(int run) const { return description.run_config(run_of(run).index); }

  const job::Job& job_of(int run) {
    if (job_run == run) return *opened_job;
    job_run.reset();
    if (ground_world != world_of(run)) ground = surface = nullptr;
    opened_job = job::prepare_job(config_of(run), context, store_folder(run), ground);
    ground = opened_job->ground;
    ground_world = world_of(run);
    check_sequences(run);
    job_run = run;
    return *opened_job;
  }

  /// What the data held when the plan was made decides how work was cut.
  void check_sequences(int run) const {
    check_flight_files(run_of(run), world_of(run), config_of(run));
    const std::vector<PlannedSequence>& planned = run_of(run).sequences;
    bool is_same = planned.size() == opened_job->sequences.size();
    for (std::size_t i = 0; is_same && i < planned.size(); ++i)
      is_same = planned[i] ==
                PlannedSequence{opened_job->sequences[i].name,
                                static_cast<std::int64_t>(opened_job->sequences[i].states.size())};
    if (!is_same)
      fail(ErrorKind::Input,
           "{}: its flights are others than when the plan was made, so its sources have changed; "
           "bring them back, or take the change up with `terracast batch plan --update`",
           run_of(run).name);
  }

  fs::path store_folder(int run) const { return folder.world(world_of(run), run_of(run)); }

  const world::TileStore& store_of(int run) {
    if (store_run != run) {
      opened_store = world::TileStore::open(store_folder(run));
      store_run = run;
    }
    return *opened_store;
  }

  /// Does work that reads the world of a run. Where it fails over a damaged file of the world, the
  /// world is mended, and the work done again.
  template <class Work>
  auto with_world(int run, const Work& work) {
    const fs::path world = folder.tiles(world_of(run)).parent_path();
    try {
      return work();
    } catch (const core::Error& error) {
      if (!tells_of(error, world) || has_unplanned_edits(run_of(run), store_folder(run))) throw;
      context.log.warn("{}; looking for damaged tiles", error.what());
    }
    core::with_context([&] { mend_world(run); },
                       fmt::format("mending the world {}", world.string()));
    return work();
  }

  /// Whether a run of the same world has edits, planned or not.
  bool is_world_edited(int run) const {
    return std::any_of(plan.runs.begin(), plan.runs.end(), [&](const PlannedRun& other) {
      if (other.world != run_of(run).world) return false;
      return !other.edits.empty() || has_unplanned_edits(other, folder.world(world_of(run), other));
    });
  }

  /// Has a run's store made again. Whole tiles stay, unless nobody knows any more what they are of;
  /// those that were edited stay even so, as nobody could make them again.
  void mend_world(int run) {
    check_edits(run_of(run), store_folder(run));
    Attempt attempt(folder);
    const fs::path inputs = folder.tiles(world_of(run)) / "inputs.json";
    try {
      core::check_content_hash(core::Json::read(inputs));
    } catch (const core::Error& error) {
      if (error.kind() == ErrorKind::Input)
        attempt.take_away(is_world_edited(run) ? inputs : inputs.parent_path());
      if (error.kind() == ErrorKind::Interrupted) throw;
    }
    attempt.take_away(store_folder(run));
    store_run.reset();
    make_tiles(run);
  }

  ShardResult tile(const Shard& shard) {
    const int run = shard.pieces.front().run;
    return {.bytes = bytes_added(with_world(run, [&] { return make_tiles(run); }))};
  }

  world::TileStore make_tiles(int run) {
    const job::Job& job = job_of(run);
    if (surface == nullptr) surface = job::lay_out_world(job, context);
    claim_tiles(run, surface->input_hash());
    check_edits(run_of(run), store_folder(run));
    return job::tile(job, store_folder(run), context, surface);
  }

  /// Of the tiles that were made since the work on a run's world began.
  static double bytes_added(const world::TileStore& store) {
    const auto begin = fs::last_write_time(store.folder() / "inputs.json");
    double bytes = static_cast<double>(fs::file_size(store.folder() / "manifest.json"));
    for (const world::TileInfo& tile : store.manifest().tiles)
      if (fs::last_write_time(world::tile_path(store.folder(), tile.id)) >= begin)
        bytes += static_cast<double>(tile.num_bytes);
    return bytes;
  }

  /// Runs of one world share its tiles: the folder of each has the others' by a link.
  void claim_tiles(int run, const std::string& input_hash) const {
    const fs::path shared = folder.tiles(world_of(run));
    const fs::path inputs = shared / "inputs.json";
    core::Json json = core::Json::object();
    json.set("input_hash", input_hash);
    core::add_content_hash(json);
    const std::string text = json.text() + "\n";
    if (!core::write_new_file(inputs, text) && core::read_text_file(inputs) != text)
      fail(
          ErrorKind::Input,
          "{}: these tiles were made of other sources than those that are there now, whose hash is "
          "{}; bring them back, or take the change up with `terracast batch plan --update`",
          inputs.string(), input_hash);
    core::make_folder(store_folder(run));
    std::error_code error;
    const fs::path link = store_folder(run) / "tiles";
    fs::create_directory_symlink(fs::path("..") / shared.filename(), link, error);
    if (error && !fs::is_directory(link))
      fail(ErrorKind::Io, "{}: cannot be made a link: {}", link.string(), error.message());
  }

  /// Of a sequence, under its inputs in the plan's other revisions.
  std::vector<fs::path> earlier_captures(int run, const std::string& sequence) const {
    std::vector<fs::path> folders;
    std::error_code missing;
    for (const auto& entry : fs::directory_iterator(folder.captures_of_all(run_of(run)), missing))
      if (entry.path() != folder.captures(run_of(run))) folders.push_back(entry.path() / sequence);
    std::sort(folders.begin(), folders.end());
    return folders;
  }

  ShardResult render(const Shard& shard) {
    ShardResult result;
    for (const Piece& piece : shard.pieces) {
      const auto index = static_cast<std::size_t>(piece.sequence);
      result.num_rendered +=
          render_frames(piece.run, index, {.first = piece.first_frame, .end = piece.end_frame});
      const fs::path captured =
          folder.captures(run_of(piece.run)) / run_of(piece.run).sequences[index].name;
      result.num_frames += piece.end_frame - piece.first_frame;
      result.bytes += bytes_of_frames(captured, piece.first_frame, piece.end_frame);
    }
    return result;
  }

  /// returns   how many frames could not be taken over
  std::int64_t render_frames(int run, std::size_t index, const capture::FrameSelection& selection) {
    return with_world(run, [&] {
      const job::Job& job = job_of(run);
      const render::SequencePlan& sequence = job.sequences[index];
      const render::RenderedFrames made = job::render_sequence(
          job, sequence, store_of(run), selection, folder.captures(run_of(run)) / sequence.name,
          context, earlier_captures(run, sequence.name));
      return static_cast<std::int64_t>(made.rendered.size());
    });
  }

  /// The config with the one export, and with the sequences that its entries were split into.
  job::RunConfig export_config(const Piece& piece) {
    job::RunConfig config = config_of(piece.run);
    const bool has_split =
        std::any_of(config.trajectories.begin(), config.trajectories.end(),
                    [](const auto& trajectory) { return trajectory.kind_options().is_split(); });
    if (has_split) config = job_of(piece.run).config;
    config.exports = {config.exports.at(static_cast<std::size_t>(piece.format))};
    return config;
  }

  void export_captures(const Piece& piece, const fs::path& out) {
    job::OutputFolders folders(out);
    folders.captures = folder.captures(run_of(piece.run));
    folders.exports = out;
    const job::RunConfig config = export_config(piece);
    for (int num_mended = 0;; ++num_mended) {
      try {
        if (!job::wanted_labels(config).empty())
          with_world(piece.run,
                     [&] { job::label(config, store_of(piece.run), folders.captures, context); });
        return job::export_formats(config, folders, context);
      } catch (const core::Error& error) {
        if (error.kind() != ErrorKind::Input || num_mended == kMostMended) throw;
        context.log.warn("{}: {}; looking for damaged frames", run_of(piece.run).name,
                         error.what());
      }
      for (std::size_t i = 0; i < run_of(piece.run).sequences.size(); ++i)
        render_frames(piece.run, i, {});
    }
  }

  /// Once a run, when its first format is exported, which sees to it that all frames are whole.
  void summarise(int run) {
    const job::Job& job = job_of(run);
    const world::WorldManifest& manifest = store_of(run).manifest();
    const GroundOptions options{.ground = ground_identity(manifest),
                                .within_m = description.dataset().reach_m()};
    const auto height_above_ground = [&](const geo::Geodetic& place) {
      const auto ground_m = job.ground->measured_height_m(place.lat_deg, place.lon_deg);
      return ground_m ? place.height_m - *ground_m : std::numeric_limits<double>::quiet_NaN();
    };
    for (const PlannedSequence& sequence : run_of(run).sequences) {
      const auto reader =
          capture::SequenceReader::open(folder.captures(run_of(run)) / sequence.name);
      const core::Json summary = json_from_summary(
          summary_of(run_of(run).name, reader, manifest, options, height_above_ground));
      throw_if_outdated(folder.root, plan.revision);
      summary.write(folder.summary(run_of(run), sequence.name), -1);
    }
  }

  ShardResult export_runs(const Shard& shard, const std::function<bool()>& is_done) {
    ShardResult result;
    for (const Piece& piece : shard.pieces) {
      const PlannedRun& run = run_of(piece.run);
      const auto number = static_cast<std::size_t>(piece.format);
      check_plugins_of_format(run, number, config_of(piece.run), description.dataset().within_m);
      const std::string& format = run.formats[number].name;
      Attempt attempt(folder);
      export_captures(piece, attempt.folder());
      if (piece.format == 0) with_world(piece.run, [&] { summarise(piece.run); });
      const fs::path made = attempt.folder() / format;
      result.bytes += bytes_in(made);
      result.num_frames += run.num_frames();
      place(attempt, made, checked_folder(plan, folder, shard.id, piece), is_done);
    }
    return result;
  }

  ShardResult validate_runs(const Shard& shard, const std::function<bool()>& is_done) {
    ShardResult result;
    for (const Piece& piece : shard.pieces) {
      const PlannedRun& run = run_of(piece.run);
      Attempt attempt(folder);
      const fs::path made = attempt.folder() / "report";
      result.num_checks_failed += validate(piece, made);
      result.bytes += bytes_in(made);
      result.num_frames += run.num_frames();
      place(attempt, made, checked_folder(plan, folder, shard.id, piece), is_done);
    }
    return result;
  }

  /// Puts a folder in its place, and the checksums of its files in theirs.
  void place(Attempt& attempt, const fs::path& made, const CheckedFolder& checked,
             const std::function<bool()>& is_done) {
    const std::string checksums = core::checksum_lines(checksums_of(made, checked.folder));
    if (is_done()) return;
    throw_if_outdated(folder.root, plan.revision);  // or it would go into the newer one's place
    attempt.place(made, checked.root / checked.folder);
    attempt.place_text(checksums, checked.checksums);
  }

  /// returns   how many checks fail
  /// throws    Input: what was exported has changed since; a dataset is not called wrong for that
  int validate(const Piece& piece, const fs::path& report) {
    const PlannedRun& run = run_of(piece.run);
    const std::string& format = run.formats[static_cast<std::size_t>(piece.format)].name;
    check_plugins_of_checks(run, config_of(piece.run));
    int num_failed = 0;
    try {
      const auto checks = with_world(piece.run, [&] {
        return validate::run_validate_stage(
            folder.dataset() / JobFolder::exported(run, format),
            job::validate_options(config_of(piece.run), format, store_of(piece.run)), report,
            context);
      });
      for (const validate::CheckResult& check : checks)
        num_failed += check.ok || check.skipped ? 0 : 1;
    } catch (const core::Error& error) {
      if (error.kind() == ErrorKind::Input || error.kind() == ErrorKind::Io) refuse_damaged(piece);
      throw;
    }
    if (num_failed > 0) refuse_damaged(piece);
    return num_failed;
  }

  void refuse_damaged(const Piece& piece) const {
    std::vector<core::FileChecksum> checksums;
    const std::vector<DamagedFile> damaged =
        find_damaged({checked_folder(plan, folder, {Stage::Export, 0}, piece)}, context, checksums);
    if (!damaged.empty()) fail(ErrorKind::Input, "{}", damage_message(damaged, folder));
  }
};

ShardWork::ShardWork(const Plan& plan, JobFolder folder, const core::Context& context)
    : impl_(std::make_unique<Impl>(plan, std::move(folder), context)) {}
ShardWork::~ShardWork() = default;

ShardResult ShardWork::run(const Shard& shard, const std::function<bool()>& is_done) {
  return core::with_context(
      [&]() -> ShardResult {
        switch (shard.id.stage) {
          case Stage::Tile:
            return impl_->tile(shard);
          case Stage::Render:
            return impl_->render(shard);
          case Stage::Export:
            return impl_->export_runs(shard, is_done);
          case Stage::Validate:
            return impl_->validate_runs(shard, is_done);
          case Stage::Merge:
            break;
        }
        return merge(impl_->plan, impl_->folder, impl_->context);
      },
      fmt::format("working on shard {}", shard.id.text()));
}

void ShardWork::clear_up(const Shard& shard) const {
  // What exports, reports and the merge put in place comes from attempts.
  for (const Piece& piece : shard.pieces) {
    const PlannedRun& run = impl_->run_of(piece.run);
    switch (shard.id.stage) {
      case Stage::Tile:
        core::remove_temporaries(impl_->store_folder(piece.run));
        core::remove_temporaries(impl_->folder.tiles(impl_->world_of(piece.run)));
        break;
      case Stage::Render:
        core::remove_temporaries(impl_->folder.captures(run) /
                                 run.sequences[static_cast<std::size_t>(piece.sequence)].name);
        break;
      case Stage::Export:  // which makes damaged frames again
        core::remove_temporaries(impl_->folder.captures(run));
        for (const PlannedSequence& sequence : run.sequences)
          core::remove_temporaries(impl_->folder.summary(run, sequence.name).parent_path());
        break;
      case Stage::Validate:
      case Stage::Merge:
        break;
    }
  }
}

}  // namespace terracast::batch
