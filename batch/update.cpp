#include "batch/update.h"

#include <algorithm>
#include <set>
#include <sstream>

#include "batch/claims.h"
#include "core/atomic_file.h"
#include "core/process_id.h"
#include "export/exporter.h"
#include "world/tile_file.h"
#include "world/tile_store.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

/// All that a shard's result depends on, as a line; nothing for the merge, which depends on all.
std::string signature_of(const Plan& plan, const Shard& shard) {
  if (shard.pieces.empty()) return {};
  const PlannedRun& run = plan.runs[static_cast<std::size_t>(shard.pieces.front().run)];
  std::string text = fmt::format("{} {} {}", stage_name(shard.id.stage), run.name, run.key);
  for (const Piece& piece : shard.pieces) {
    switch (shard.id.stage) {
      case Stage::Render:
        text += fmt::format(" {} {} {}", piece.sequence, piece.first_frame, piece.end_frame);
        break;
      case Stage::Validate:
        text += " " + run.checks;
        [[fallthrough]];
      case Stage::Export: {
        const PlannedFormat& format = run.formats[static_cast<std::size_t>(piece.format)];
        text += fmt::format(" {} {}", format.name, format.key);
        break;
      }
      case Stage::Tile:
      case Stage::Merge:
        break;
    }
  }
  return text;
}

void copy_checksums(const JobFolder& from, const JobFolder& to, const Plan& plan,
                    const Shard& shard) {
  for (const Piece& piece : shard.pieces) {
    const PlannedRun& run = plan.runs[static_cast<std::size_t>(piece.run)];
    const std::string& format = run.formats[static_cast<std::size_t>(piece.format)].name;
    const auto copy = [](const fs::path& source, const fs::path& target) {
      core::write_file(target, core::read_text_file(source));
    };
    if (shard.id.stage == Stage::Export)
      copy(from.checksums(run, format), to.checksums(run, format));
    if (shard.id.stage == Stage::Validate)
      copy(from.report_checksums(run, format), to.report_checksums(run, format));
  }
}

/// Edited tiles, and the hash of what they hold. As text a line each: "3/-1/0 HASH".
using Edits = std::map<world::TileId, std::string>;

Edits edits_from_text(const std::string& text) {
  Edits edits;
  std::istringstream words(text);
  world::TileId id;
  std::string content_hash;
  for (char slash = 0; words >> id.level >> slash >> id.x >> slash >> id.y >> content_hash;)
    edits[id] = content_hash;
  return edits;
}

std::string text_of(const Edits& edits) {
  std::string text;
  for (const auto& [id, content_hash] : edits)
    text += fmt::format("{} {}\n", id.name(), content_hash);
  return text;
}

/// What a tile that is there was changed to.
std::string edited_hash(const fs::path& store_folder, const world::TileId& id) {
  const auto now = world::inspect_tile(store_folder, id);
  if (!now)
    fail(ErrorKind::Input,
         "{}: this tile was changed, and is damaged; remove it to have it made again, or bring a "
         "whole one",
         world::tile_path(store_folder, id).string());
  return now->content_hash;
}

/// The tiles of a run's world that differ from its manifest.
Edits changed_tiles(const fs::path& store_folder) {
  const world::TileStore store = world::TileStore::open(store_folder);
  const auto written = fs::last_write_time(store_folder / "manifest.json");
  Edits changed;
  for (const world::TileInfo& tile : store.manifest().tiles) {
    const fs::path file = world::tile_path(store_folder, tile.id);
    std::error_code missing;
    const auto time = fs::last_write_time(file, missing);
    if (missing || (time <= written && fs::file_size(file, missing) == tile.num_bytes)) continue;
    const std::string now = edited_hash(store_folder, tile.id);
    if (now != tile.content_hash) changed[tile.id] = now;
  }
  return changed;
}

}  // namespace

bool has_unplanned_edits(const PlannedRun& run, const fs::path& store_folder) {
  const Edits planned = edits_from_text(run.edits);
  try {
    const auto store = world::TileStore::open(store_folder);
    const auto is_edited = [&](const world::TileInfo& tile) {
      const auto now = world::inspect_tile(store_folder, tile.id);
      if (!now || now->content_hash == tile.content_hash) return false;
      const auto edit = planned.find(tile.id);
      return edit == planned.end() || edit->second != now->content_hash;
    };
    const auto& tiles = store.manifest().tiles;
    return std::any_of(tiles.begin(), tiles.end(), is_edited);
  } catch (const core::Error& error) {
    if (error.kind() == ErrorKind::Input || error.kind() == ErrorKind::Io) return false;
    throw;
  }
}

std::vector<fs::path> lost_edits(const PlannedRun& run, const fs::path& store_folder) {
  std::vector<fs::path> lost;
  for (const auto& [id, content_hash] : edits_from_text(run.edits)) {
    const auto now = world::inspect_tile(store_folder.parent_path(), id);
    if (!now || now->content_hash != content_hash)
      lost.push_back(world::tile_path(store_folder.parent_path(), id));
  }
  return lost;
}

void check_edits(const PlannedRun& run, const fs::path& store_folder) {
  for (const fs::path& tile : lost_edits(run, store_folder))
    fail(ErrorKind::Input,
         "{}: this tile was edited, and is damaged, missing or another than planned; bring the "
         "edited file back, or take up what is there with `terracast batch plan --update`, for "
         "which a tile that is removed is made of its sources again",
         tile.string());
}

TileEdits find_edits(const Plan& plan, const JobFolder& folder) {
  TileEdits found;
  std::map<std::string, Edits> of_worlds;
  for (const PlannedRun& run : plan.runs) {
    const std::string& world = plan.worlds[static_cast<std::size_t>(run.world)];
    const fs::path store = folder.world(world, run);
    Edits edits;
    std::error_code missing;
    for (const auto& [id, planned_hash] : edits_from_text(run.edits)) {
      const fs::path file = world::tile_path(store.parent_path(), id);
      if (fs::exists(file, missing))
        edits[id] = edited_hash(store.parent_path(), id);
      else
        found.removed.insert(file);
    }
    if (fs::exists(store / "manifest.json", missing)) edits.merge(changed_tiles(store));
    found.of_runs[run.name] = text_of(edits);
    of_worlds[world].merge(edits);
  }
  for (const auto& [world, edits] : of_worlds) found.of_worlds[world] = text_of(edits);
  // A run whose world is not tiled yet will have whatever is there.
  for (const PlannedRun& run : plan.runs) {
    const std::string& world = plan.worlds[static_cast<std::size_t>(run.world)];
    std::error_code missing;
    if (!fs::exists(folder.world(world, run) / "manifest.json", missing))
      found.of_runs[run.name] = found.of_worlds[world];
  }
  return found;
}

namespace {

/// Calls keep(shard, earlier) for each shard of a plan that is done in the previous one, as that is
/// called there, and counts.
template <class Keep>
Update for_each_kept(const Plan& previous, const Plan& plan, const Claims& claims_before,
                     const Keep& keep) {
  Update update;
  for (const Stage stage : kStages) {
    std::map<std::string, ShardId> done;
    for (const int index : claims_before.done(stage))
      if (static_cast<std::size_t>(index) < previous.of(stage).size()) {
        const Shard& shard = previous.of(stage)[static_cast<std::size_t>(index)];
        done.emplace(signature_of(previous, shard), shard.id);
      }
    for (const Shard& shard : plan.of(stage)) {
      const std::string signature = signature_of(plan, shard);
      const auto known = done.find(signature);
      if (signature.empty() || known == done.end()) {
        ++update.num_open;
        continue;
      }
      keep(shard, known->second);
      ++update.num_kept;
    }
  }
  return update;
}

}  // namespace

Update compare(const Plan& previous, const Plan& plan, const fs::path& job) {
  const Claims claims(JobFolder{job, previous.revision}.state(), previous.claims);
  return for_each_kept(previous, plan, claims, [](const Shard&, const ShardId&) {});
}

Update carry_over(const Plan& previous, const Plan& plan, const fs::path& job) {
  const JobFolder before{job, previous.revision};
  const JobFolder after{job, plan.revision};
  std::error_code ignored;
  fs::remove_all(after.state(), ignored);  // of an update that was cut off
  Claims claims_before(before.state(), previous.claims);
  Claims claims_after(after.state(), plan.claims);
  return for_each_kept(
      previous, plan, claims_before, [&](const Shard& shard, const ShardId& earlier) {
        if (shard.id.stage == Stage::Export || shard.id.stage == Stage::Validate)
          core::with_context([&] { copy_checksums(before, after, plan, shard); },
                             fmt::format("keeping shard {}; `terracast batch verify {} --repair` "
                                         "has what is damaged made again",
                                         earlier.text(), job.string()));
        claims_after.set_done(shard.id, claims_before.record(earlier));
      });
}

UpdateRight::UpdateRight(const fs::path& job) : file_(job / "plan" / ".update") {
  constexpr int kMostTries = 3;  // one that has ended makes room; others may come meanwhile
  for (int i = 0; i < kMostTries; ++i) {
    if (core::write_new_file(file_, core::this_process())) return;
    std::string holder;
    try {
      holder = core::read_text_file(file_);
    } catch (const core::Error&) {
      continue;  // given back just now
    }
    if (core::process_state(holder) != core::ProcessState::Ended) break;
    std::error_code ignored;
    fs::remove(file_, ignored);
  }
  fail(
      ErrorKind::Usage,
      "{}: another process is updating this job; wait for its end, or remove this file when it was "
      "on a machine that has died",
      file_.string());
}

UpdateRight::~UpdateRight() {
  std::error_code ignored;
  fs::remove(file_, ignored);
}

namespace {

/// Whether a folder may be a run's, "run0012", and not somebody's own.
bool is_of_run(const fs::path& folder) {
  const std::string name = folder.filename().string();
  return name.starts_with("run") && name.size() > 3 &&
         name.find_first_not_of("0123456789", 3) == std::string::npos;
}

void remove_whole(const fs::path& folder) {
  std::error_code error;
  fs::remove_all(folder, error);
  if (error) fail(ErrorKind::Io, "{}: cannot be removed: {}", folder.string(), error.message());
}

std::vector<fs::path> entries_of(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code missing;
  for (const auto& entry : fs::directory_iterator(folder, missing)) entries.push_back(entry.path());
  return entries;
}

}  // namespace

void remove_unplanned(const Plan& plan, const JobFolder& folder) {
  std::set<fs::path> planned;
  for (const PlannedRun& run : plan.runs)
    for (const PlannedFormat& format : run.formats)
      planned.insert(JobFolder::exported(run, format.name));
  const auto is_planned = [&](const fs::path& format, const fs::path& run) {
    return planned.contains(format.filename() / run.filename());
  };
  for (const exporters::ExporterInfo& format : exporters::exporters())
    for (const fs::path& run : entries_of(folder.dataset() / format.name))
      if (is_of_run(run) && !is_planned(format.name, run)) remove_whole(run);
  for (const fs::path& run : entries_of(folder.root / "report"))
    for (const fs::path& format : entries_of(run))
      if (is_of_run(run) && !is_planned(format, run)) remove_whole(format);
}

}  // namespace terracast::batch
