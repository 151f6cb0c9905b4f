#include "batch/shard_work.h"

#include <map>
#include <optional>

#include "batch/checksums.h"
#include "batch/dataset/sequence_summary.h"
#include "batch/merge.h"
#include "core/atomic_file.h"
#include "job/stages.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

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
  std::string surface_world;
  std::shared_ptr<const tiler::WorldSurface> surface;
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
    if (surface_world != world_of(run)) surface = nullptr;
    opened_job = job::prepare_job(config_of(run), context, surface);
    surface = opened_job->surface;
    surface_world = world_of(run);
    check_sequences(run);
    job_run = run;
    return *opened_job;
  }

  /// What the data held when the plan was made decides how work was cut.
  void check_sequences(int run) const {
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

  ShardResult tile(const Shard& shard) {
    const int run = shard.pieces.front().run;
    const job::Job& job = job_of(run);
    claim_tiles(run, job.surface->input_hash());
    const world::TileStore store = job::tile(job, store_folder(run), context);
    return {.bytes = bytes_added(store)};
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
    const std::string text = core::Json::object().set("input_hash", input_hash).text() + "\n";
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
    for (const auto& entry :
         fs::directory_iterator(folder.captures_of_all(run_of(run)), missing))
      if (entry.path() != folder.captures(run_of(run))) folders.push_back(entry.path() / sequence);
    std::sort(folders.begin(), folders.end());
    return folders;
  }

  ShardResult render(const Shard& shard) {
    ShardResult result;
    for (const Piece& piece : shard.pieces) {
      const job::Job& job = job_of(piece.run);
      const render::SequencePlan& sequence =
          job.sequences[static_cast<std::size_t>(piece.sequence)];
      const fs::path captured = folder.captures(run_of(piece.run)) / sequence.name;
      const render::RenderedFrames made = job::render_sequence(
          job, sequence, store_of(piece.run), {.first = piece.first_frame, .end = piece.end_frame},
          captured, context, earlier_captures(piece.run, sequence.name));
      result.num_rendered += static_cast<std::int64_t>(made.rendered.size());
      result.num_frames += piece.end_frame - piece.first_frame;
      result.bytes += bytes_of_frames(captured, piece.first_frame, piece.end_frame);
    }
    return result;
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
    try {
      job::export_formats(config, folders, context);
    } catch (const core::Error& error) {
      if (error.kind() != ErrorKind::Input) throw;
      context.log.warn("{}: {}; looking for damaged frames", run_of(piece.run).name, error.what());
      const job::Job& job = job_of(piece.run);
      for (const render::SequencePlan& sequence : job.sequences)
        job::render_sequence(job, sequence, store_of(piece.run), {},
                             folders.captures / sequence.name, context);
      job::export_formats(config, folders, context);
    }
  }

  /// Once a run, when its first format is exported, which sees to it that all frames are whole.
  void summarise(int run) {
    const job::Job& job = job_of(run);
    const world::WorldManifest& manifest = store_of(run).manifest();
    const GroundOptions options{.ground = ground_identity(manifest),
                                .within_m = description.dataset().reach_m()};
    const auto height_above_ground = [&](const geo::Geodetic& place) {
      const auto ground_m = job.surface->measured_height_m(place.lat_deg, place.lon_deg);
      return ground_m ? place.height_m - *ground_m : std::numeric_limits<double>::quiet_NaN();
    };
    for (const PlannedSequence& sequence : run_of(run).sequences) {
      const auto reader =
          capture::SequenceReader::open(folder.captures(run_of(run)) / sequence.name);
      json_from_summary(
          summary_of(run_of(run).name, reader, manifest, options, height_above_ground))
          .write(folder.summary(run_of(run), sequence.name), -1);
    }
  }

  ShardResult export_runs(const Shard& shard) {
    ShardResult result;
    for (const Piece& piece : shard.pieces) {
      const PlannedRun& run = run_of(piece.run);
      const std::string& format = run.formats[static_cast<std::size_t>(piece.format)].name;
      Attempt attempt(folder);
      export_captures(piece, attempt.folder());
      if (piece.format == 0) summarise(piece.run);
      const fs::path made = attempt.folder() / format;
      const auto checksums = checksums_of(made, JobFolder::exported(run, format));
      result.bytes += bytes_in(made);
      result.num_frames += run.num_frames();
      attempt.place(made, folder.dataset() / JobFolder::exported(run, format));
      core::write_file(folder.checksums(run, format), core::checksum_lines(checksums));
    }
    return result;
  }

  ShardResult validate_runs(const Shard& shard) {
    ShardResult result;
    for (const Piece& piece : shard.pieces) {
      const PlannedRun& run = run_of(piece.run);
      const std::string& format = run.formats[static_cast<std::size_t>(piece.format)].name;
      Attempt attempt(folder);
      const fs::path made = attempt.folder() / "report";
      const auto checks = validate::run_validate_stage(
          folder.dataset() / JobFolder::exported(run, format),
          job::validate_options(config_of(piece.run), format, store_of(piece.run)), made, context);
      for (const validate::CheckResult& check : checks)
        result.num_checks_failed += check.ok || check.skipped ? 0 : 1;
      result.bytes += bytes_in(made);
      result.num_frames += run.num_frames();
      attempt.place(made, folder.report(run, format));
    }
    return result;
  }
};

ShardWork::ShardWork(const Plan& plan, JobFolder folder, const core::Context& context)
    : impl_(std::make_unique<Impl>(plan, std::move(folder), context)) {}
ShardWork::~ShardWork() = default;

ShardResult ShardWork::run(const Shard& shard) {
  return core::with_context(
      [&]() -> ShardResult {
        switch (shard.id.stage) {
          case Stage::Tile:
            return impl_->tile(shard);
          case Stage::Render:
            return impl_->render(shard);
          case Stage::Export:
            return impl_->export_runs(shard);
          case Stage::Validate:
            return impl_->validate_runs(shard);
          case Stage::Merge:
            break;
        }
        return merge(impl_->plan, impl_->folder, impl_->context);
      },
      fmt::format("working on shard {}", shard.id.text()));
}

}  // namespace terracast::batch
