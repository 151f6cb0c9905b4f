#include "batch/plan.h"

#include <algorithm>
#include <charconv>

#include "capture/sequence_files.h"
#include "core/atomic_file.h"
#include "core/hash.h"
#include "core/process_id.h"
#include "core/stage_cost.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;
using core::Json;

constexpr int kPlanVersion = 2;
constexpr const char* kPlanFile = "plan.json";
constexpr const char* kConfigFile = "config.json";
constexpr const char* kRunsFile = "runs.jsonl";
constexpr const char* kShardsFile = "shards.jsonl";

fs::path plans_folder(const fs::path& job_folder) { return job_folder / "plan"; }

/// 0 where there is none.
int last_revision(const fs::path& job_folder) {
  int last = 0;
  std::error_code missing;
  for (const fs::directory_entry& entry :
       fs::directory_iterator(plans_folder(job_folder), missing)) {
    const std::string name = entry.path().filename().string();
    int revision = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), revision);
    if (error == std::errc() && end == name.data() + name.size()) last = std::max(last, revision);
  }
  return last;
}

Json json_from_run(const PlannedRun& run) {
  Json sequences = Json::array();
  for (const PlannedSequence& sequence : run.sequences)
    sequences.push(Json::array().push(sequence.name).push(sequence.num_frames));
  Json formats = Json::array();
  for (const PlannedFormat& format : run.formats)
    formats.push(Json::array().push(format.name).push(format.key));
  return Json::object()
      .set("name", run.name)
      .set("index", run.index)
      .set("changes", run.changes)
      .set("identity", run.identity)
      .set("key", run.key)
      .set("edits", run.edits)
      .set("checks", run.checks)
      .set("world", run.world)
      .set("sequences", std::move(sequences))
      .set("formats", std::move(formats));
}

/// A count or index from a file, within bounds.
int number_from(const Json& json, std::int64_t end) {
  const std::int64_t value = json.integer();
  if (value < 0 || value >= end) fail(ErrorKind::Input, "{} is outside 0 to {}", value, end - 1);
  return static_cast<int>(value);
}

constexpr std::int64_t kManyTries = 1000001;
constexpr std::int64_t kManyFrames = std::int64_t{1} << 31;

/// A format's name is a folder's too; one of a plug-in has a dot.
bool is_format_name(const std::string& name) {
  const std::size_t dot = name.find('.');
  return capture::is_safe_name(name.substr(0, dot)) &&
         (dot == std::string::npos || capture::is_safe_name(name.substr(dot + 1)));
}

PlannedRun run_from_json(const Json& json, std::size_t num_worlds) {
  PlannedRun run{.name = json.at("name").string(),
                 .index = json.at("index").integer(),
                 .identity = json.at("identity").string(),
                 .changes = json.at("changes").string(),
                 .key = json.at("key").string(),
                 .edits = json.at("edits").string(),
                 .checks = json.at("checks").string(),
                 .world = number_from(json.at("world"), static_cast<std::int64_t>(num_worlds)),
                 .sequences = {},
                 .formats = {}};
  for (const std::string& name : {run.name, run.key})
    if (!capture::is_safe_name(name)) fail(ErrorKind::Input, "\"{}\" cannot be a folder", name);
  for (std::size_t i = 0; i < json.at("sequences").size(); ++i) {
    const Json& sequence = json.at("sequences").at(i);
    run.sequences.push_back({sequence.at(0).string(), number_from(sequence.at(1), kManyFrames)});
    if (!capture::is_safe_name(run.sequences.back().name))
      fail(ErrorKind::Input, "\"{}\" cannot be a folder", run.sequences.back().name);
  }
  for (std::size_t i = 0; i < json.at("formats").size(); ++i) {
    const Json& format = json.at("formats").at(i);
    run.formats.push_back({format.at(0).string(), format.at(1).string()});
    if (!is_format_name(run.formats.back().name))
      fail(ErrorKind::Input, "\"{}\" cannot be a folder", run.formats.back().name);
  }
  return run;
}

/// Pieces as short lists, since there are many: [run], [run, sequence, first, end], [run, format].
Json json_from_piece(const Piece& piece, Stage stage) {
  Json list = Json::array().push(piece.run);
  if (stage == Stage::Render)
    list.push(piece.sequence).push(piece.first_frame).push(piece.end_frame);
  if (stage == Stage::Export || stage == Stage::Validate) list.push(piece.format);
  return list;
}

Piece piece_from_json(const Json& json, Stage stage, const std::vector<PlannedRun>& runs) {
  Piece piece{.run = number_from(json.at(0), static_cast<std::int64_t>(runs.size()))};
  const PlannedRun& run = runs[static_cast<std::size_t>(piece.run)];
  if (stage == Stage::Render) {
    piece.sequence = number_from(json.at(1), static_cast<std::int64_t>(run.sequences.size()));
    const std::int64_t num_frames =
        run.sequences[static_cast<std::size_t>(piece.sequence)].num_frames;
    piece.first_frame = number_from(json.at(2), num_frames);
    piece.end_frame = number_from(json.at(3), num_frames + 1);
  }
  if (stage == Stage::Export || stage == Stage::Validate)
    piece.format = number_from(json.at(1), static_cast<std::int64_t>(run.formats.size()));
  return piece;
}

Json json_from_shard(const Shard& shard) {
  Json pieces = Json::array();
  for (const Piece& piece : shard.pieces) pieces.push(json_from_piece(piece, shard.id.stage));
  return Json::object()
      .set("shard", shard.id.text())
      .set("cpu_s", shard.cost.cpu_s)
      .set("bytes", shard.cost.bytes)
      .set("pieces", std::move(pieces));
}

Shard shard_from_json(const Json& json, const std::vector<PlannedRun>& runs) {
  Shard shard{.id = ShardId::parse(json.at("shard").string()),
              .pieces = {},
              .cost = {.cpu_s = json.at("cpu_s").number(), .bytes = json.at("bytes").number()}};
  for (std::size_t i = 0; i < json.at("pieces").size(); ++i)
    shard.pieces.push_back(piece_from_json(json.at("pieces").at(i), shard.id.stage, runs));
  if (shard.pieces.empty() && shard.id.stage != Stage::Merge)
    fail(ErrorKind::Input, "shard {} has nothing to do", shard.id.text());
  return shard;
}

/// Calls take(json) for each line of a file; errors name the line.
template <class Take>
void read_lines(const fs::path& file, const Take& take) {
  const std::string text = core::read_text_file(file);
  std::size_t begin = 0;
  for (int line = 1; begin < text.size(); ++line) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    core::with_context(
        [&] {
          take(Json::parse(std::string_view(text).substr(begin, end - begin), file.string()));
        },
        fmt::format("reading line {} of {}", line, file.string()));
    begin = end + 1;
  }
}

/// Folders of plans that were never put in place: kUnfinished + this_process() + "-" + random_name().
constexpr std::string_view kUnfinished = ".new-";

void remove_unfinished(const fs::path& folder) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kUnfinished)) continue;
    const std::string process =
        name.substr(kUnfinished.size(), name.rfind('-') - kUnfinished.size());
    if (core::process_state(process) == core::ProcessState::Ended)
      fs::remove_all(entry.path(), ignored);
  }
}

/// Shards that were planned for other files than these would be done wrong, and nobody would see it.
void check_whole(const fs::path& file, const std::string& content_hash) {
  if (core::content_hash_of_file(file) != content_hash)
    fail(ErrorKind::Input,
         "{}: damaged: it is not what was planned; bring it back, or plan the job in another "
         "folder: the same config gives the same plan",
         file.string());
}

std::string runs_text(const Plan& plan) {
  std::string text;
  for (const PlannedRun& run : plan.runs) text += json_from_run(run).text(-1) + "\n";
  return text;
}

std::string shards_text(const Plan& plan) {
  std::string text;
  for (const std::vector<Shard>& shards : plan.shards)
    for (const Shard& shard : shards) text += json_from_shard(shard).text(-1) + "\n";
  return text;
}

std::string size_text(double bytes) {
  if (bytes >= 1e12) return fmt::format("{:.2f} TB", bytes * 1e-12);
  if (bytes >= 1e9) return fmt::format("{:.1f} GB", bytes * 1e-9);
  return fmt::format("{:.0f} MB", bytes * 1e-6);
}

}  // namespace

std::int64_t PlannedRun::num_frames() const {
  std::int64_t count = 0;
  for (const PlannedSequence& sequence : sequences) count += sequence.num_frames;
  return count;
}

std::int64_t Plan::num_frames() const {
  std::int64_t count = 0;
  for (const PlannedRun& run : runs) count += run.num_frames();
  return count;
}

std::int64_t Plan::num_sequences() const {
  std::int64_t count = 0;
  for (const PlannedRun& run : runs) count += static_cast<std::int64_t>(run.sequences.size());
  return count;
}

Cost Plan::cost_of(Stage stage) const {
  Cost cost;
  for (const Shard& shard : of(stage)) cost += shard.cost;
  return cost;
}

Cost Plan::total() const {
  Cost cost;
  for (const Stage stage : kStages) cost += cost_of(stage);
  return cost;
}

void write_plan(const Plan& plan, const fs::path& job_folder) {
  const fs::path folder = plans_folder(job_folder);
  core::make_folder(folder);
  remove_unfinished(folder);
  const fs::path unfinished =
      folder / fmt::format("{}{}-{}", kUnfinished, core::this_process(), core::random_name());
  Json stages = Json::object();
  for (const Stage stage : kStages) {
    const Cost cost = plan.cost_of(stage);
    stages.set(stage_name(stage),
               Json::object()
                   .set("shards", static_cast<std::int64_t>(plan.of(stage).size()))
                   .set("cpu_s", cost.cpu_s)
                   .set("bytes", cost.bytes));
  }
  plan.inputs.json().write(unfinished / kConfigFile);
  core::write_file(unfinished / kRunsFile, runs_text(plan));
  core::write_file(unfinished / kShardsFile, shards_text(plan));
  Json left_out = Json::array();
  for (const LeftOutRun& run : plan.left_out)
    left_out.push(Json::array().push(run.name).push(run.identity));
  Json hashes = Json::object();
  for (const char* file : {kConfigFile, kRunsFile, kShardsFile})
    hashes.set(file, core::content_hash_of_file(unfinished / file));
  Json json = Json::object();
  json.set("version", kPlanVersion)
      .set("revision", plan.revision)
      .set("name", plan.name)
      .set("runs", static_cast<std::int64_t>(plan.runs.size()))
      .set("sequences", plan.num_sequences())
      .set("frames", plan.num_frames())
      .set("memory_bytes", plan.memory_bytes)
      .set("shard_s", plan.shard_s)
      .set("lease_s", plan.claims.lease_s)
      .set("max_tries", plan.claims.max_tries)
      .set("stages", std::move(stages))
      .set("worlds", Json::array_of(plan.worlds))
      .set("left_out", std::move(left_out))
      .set("files", std::move(hashes));
  core::add_content_hash(json);
  json.write(unfinished / kPlanFile);
  std::error_code error;
  fs::rename(unfinished, folder / fmt::format("{:04}", plan.revision), error);
  if (error) {
    std::error_code ignored;
    fs::remove_all(unfinished, ignored);
    fail(ErrorKind::Io, "{}: the plan cannot be put in place: {}",
         (folder / fmt::format("{:04}", plan.revision)).string(), error.message());
  }
}

bool is_same_but_for_revision(const Plan& a, const Plan& b) {
  return a.name == b.name && a.claims.lease_s == b.claims.lease_s &&
         a.claims.max_tries == b.claims.max_tries && a.shard_s == b.shard_s &&
         a.worlds == b.worlds && a.left_out == b.left_out &&
         a.inputs.json().text() == b.inputs.json().text() && runs_text(a) == runs_text(b) &&
         shards_text(a) == shards_text(b);
}

bool has_newer_plan(const fs::path& job_folder, int revision) {
  std::error_code ignored;
  return fs::exists(plans_folder(job_folder) / fmt::format("{:04}", revision + 1), ignored);
}

void throw_if_outdated(const fs::path& job_folder, int revision) {
  if (has_newer_plan(job_folder, revision))
    fail(ErrorKind::Interrupted,
         "{}: there is a newer plan; run the same command again to go on with it",
         job_folder.string());
}

bool has_plan(const fs::path& job_folder) { return last_revision(job_folder) > 0; }

Plan read_plan(const fs::path& job_folder) {
  const int revision = last_revision(job_folder);
  if (revision == 0)
    fail(ErrorKind::Io, "{}: holds no plan; make one with `terracast batch plan CONFIG --out {}`",
         fs::absolute(job_folder).string(), job_folder.string());
  const fs::path folder = plans_folder(job_folder) / fmt::format("{:04}", revision);
  const fs::path plan_file = folder / kPlanFile;
  const Json json = Json::read(plan_file);
  if (json.at("version").integer() != kPlanVersion)
    fail(ErrorKind::Input,
         "{}: a plan of version {}, by another terracast; this one takes {}: plan the job in "
         "another "
         "folder",
         plan_file.string(), json.at("version").integer(), kPlanVersion);
  core::with_context([&] { core::check_content_hash(json); },
                     fmt::format("reading {}; bring it back, or plan the job in another folder",
                                 plan_file.string()));
  for (const char* file : {kConfigFile, kRunsFile, kShardsFile})
    check_whole(folder / file, json.at("files").at(file).string());
  Plan plan{.revision = revision,
            .name = json.at("name").string(),
            .claims = {.lease_s = json.at("lease_s").number(),
                       .max_tries = number_from(json.at("max_tries"), kManyTries)},
            .shard_s = json.at("shard_s").number(),
            .inputs = core::ConfigInputs::from_json(Json::read(folder / kConfigFile),
                                                    (folder / kConfigFile).string()),
            .worlds = json.at("worlds").strings(),
            .runs = {},
            .left_out = {},
            .shards = std::vector<std::vector<Shard>>(kStages.size()),
            .memory_bytes = json.at("memory_bytes").number()};
  const Json& left_out = json.at("left_out");
  for (std::size_t i = 0; i < left_out.size(); ++i)
    plan.left_out.push_back({left_out.at(i).at(0).string(), left_out.at(i).at(1).string()});
  for (const std::string& world : plan.worlds)
    if (!capture::is_safe_name(world))
      fail(ErrorKind::Input, "{}: the world \"{}\" cannot be a folder", plan_file.string(), world);
  read_lines(folder / kRunsFile, [&](const Json& line) {
    plan.runs.push_back(run_from_json(line, plan.worlds.size()));
  });
  if (static_cast<std::int64_t>(plan.runs.size()) != json.at("runs").integer())
    fail(ErrorKind::Input, "{}: {} runs, but {} says {}", (folder / kRunsFile).string(),
         plan.runs.size(), kPlanFile, json.at("runs").integer());
  read_lines(folder / kShardsFile, [&](const Json& line) {
    Shard shard = shard_from_json(line, plan.runs);
    std::vector<Shard>& shards = plan.shards[static_cast<std::size_t>(shard.id.stage)];
    if (shard.id.index != static_cast<int>(shards.size()))
      fail(ErrorKind::Input, "{} stands where {}/{} must", shard.id.text(),
           stage_name(shard.id.stage), shards.size());
    shards.push_back(std::move(shard));
  });
  for (const Stage stage : kStages) {
    const std::int64_t stated = json.at("stages").at(stage_name(stage)).at("shards").integer();
    if (static_cast<std::int64_t>(plan.of(stage).size()) != stated)
      fail(ErrorKind::Input, "{}: {} shards of {}, but {} says {}", (folder / kShardsFile).string(),
           plan.of(stage).size(), stage_name(stage), kPlanFile, stated);
  }
  return plan;
}

std::string describe_plan(const Plan& plan) {
  std::string text =
      fmt::format("{}: {} runs, {} sequences, {} frames, {} worlds\n", plan.name, plan.runs.size(),
                  plan.num_sequences(), plan.num_frames(), plan.worlds.size());
  for (const LeftOutRun& run : plan.left_out) text += fmt::format("left out: {}\n", run.name);
  text += fmt::format("{:10} {:>8} {:>16} {:>16} {:>12}\n", "stage", "shards", "CPU time",
                      "longest shard", "disk");
  for (const Stage stage : kStages) {
    const Cost cost = plan.cost_of(stage);
    double longest_s = 0.0;
    for (const Shard& shard : plan.of(stage)) longest_s = std::max(longest_s, shard.cost.cpu_s);
    text += fmt::format("{:10} {:>8} {:>16} {:>16} {:>12}\n", stage_name(stage),
                        plan.of(stage).size(), core::duration_text(cost.cpu_s),
                        core::duration_text(longest_s), size_text(cost.bytes));
  }
  const Cost total = plan.total();
  text += fmt::format("{:10} {:>8} {:>16} {:>16} {:>12}\n", "all", "",
                      core::duration_text(total.cpu_s), "", size_text(total.bytes));
  text += fmt::format("a process takes about {} of memory\n", size_text(plan.memory_bytes));
  return text;
}

}  // namespace terracast::batch
