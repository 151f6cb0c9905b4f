#include "tests/e2e/batch_job.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>

#include "core/json.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/folder_compare.h"
#include "tests/support/made_once.h"
#include "tests/support/run_program.h"

namespace terracast::test {

namespace fs = std::filesystem;

namespace {

/// Two runs of five frames over one world, in COLMAP's format: about five seconds of work.
constexpr const char* kBatchText = R"(name = "tiny"

[world]
name = "tiny"
origin_lat_deg = 46.0
origin_lon_deg = 7.0
size_m = 4096.0
outside = "extend"

[[world.elevation]]
kind = "ramp"
vertical_datum = "ellipsoid"

[detail]
finest_spacing_m = 16.0

[[rigs]]
name = "one"
mount_pitch_deg = 40.0

[[rigs.cameras]]
name = "camera"
width_px = 64
height_px = 48
fx_px = 48.0
fy_px = 48.0

[[trajectories]]
name = "P000"
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 250.0, above = "ground"}
radius_m = 200.0
speed_mps = 30.0
rate_hz = 1.0
num_frames = 5

[conditions]
color_samples = 1

[tracks]
num_points = 2000

[validate]
oracle_samples = 50

[[exports]]
format = "colmap"

[[sweep.product]]
key = "trajectories.0.radius_m"
values = [200.0, 300.0]
)";

}  // namespace

void copy_job(const fs::path& job, const fs::path& copy) {
  fs::copy(job, copy, fs::copy_options::recursive | fs::copy_options::copy_symlinks);
}

namespace {

fs::path job_after(const fs::path& folder, std::size_t num_stages) {
  return folder / ("after-" + std::to_string(num_stages));
}

/// Runs the batch stage by stage, with a copy of the job between any two; keeps their seconds in a file.
void make_snapshots(const fs::path& folder) {
  const fs::path config = write_text(folder / "batch.toml", kBatchText);
  const fs::path planned = job_after(folder, 0);
  const auto plan = run_program({"batch", "plan", config.string(), "--out", planned.string(),
                                 "--shard-minutes", "0.001", "-q"});
  EXPECT_EQ(plan.status, 0) << plan.output;
  std::string durations;
  for (std::size_t stage = 0; stage < kBatchStages.size(); ++stage) {
    const fs::path job = job_after(folder, stage + 1);
    copy_job(job_after(folder, stage), job);
    const auto start = std::chrono::steady_clock::now();
    const auto run =
        run_program({"batch", "run", job.string(), "--stage", kBatchStages[stage], "-q"});
    EXPECT_EQ(run.status, 0) << run.output;
    const std::chrono::duration<double> duration = std::chrono::steady_clock::now() - start;
    durations += fmt::format("{}\n", duration.count());
  }
  write_text(folder / "durations", durations);
}

}  // namespace

BatchSnapshots::BatchSnapshots() {
  const fs::path folder = made_once("batch_snapshots", kBatchText, make_snapshots);
  for (std::size_t stage = 0; stage <= kBatchStages.size(); ++stage)
    jobs_.push_back(job_after(folder, stage));
  std::ifstream durations(folder / "durations");
  for (double duration_s = 0.0; durations >> duration_s;) durations_s_.push_back(duration_s);
}

const std::vector<JobFiles>& kinds_of_job_files() {
  static const std::vector<JobFiles> kKinds = {
      {"plan", "plan", "", ""},
      {"world inputs", "world", "inputs", ".json"},
      {"tile", "world", "tiles/", ".tile"},
      {"world manifest", "world", "manifest", ".json"},
      {"sequence", "capture", "sequence", ".json"},
      {"tracks", "capture", "tracks", ".json"},
      {"frame record", "capture", "frames/", ".json"},
      {"colour image", "capture", "", ".png"},
      {"facts", "capture", "", ".exr"},
      {"capture manifest", "capture", "manifest", ".json"},
      {"summary", "summary", "", ".json"},
      {"exported file", "dataset", "/", ""},
      {"run checksums", "state/0001/checksums/colmap", "", ".sha256"},
      {"report", "report", "", ""},
      {"report checksums", "state/0001/checksums/report", "", ".sha256"},
      {"SHA256SUMS", "dataset", "SHA256SUMS", ""},
      {"done record", "state", "done/", ".json"},
      {"claim", "state", "claims/", ""},
  };
  return kKinds;
}

std::vector<std::string> job_files(const fs::path& job, const JobFiles& kind) {
  std::vector<std::string> files;
  std::error_code missing;
  const fs::path folder = job / kind.folder;
  fs::recursive_directory_iterator entry(folder, missing);
  for (; !missing && entry != fs::recursive_directory_iterator(); entry.increment(missing)) {
    const std::string path = entry->path().lexically_relative(folder).string();
    std::error_code gone;
    if (entry->is_regular_file(gone) && path.find(kind.substring) != std::string::npos &&
        path.ends_with(kind.ending) && path.find(".terracast-tmp-") == std::string::npos)
      files.push_back((fs::path(kind.folder) / path).string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string damage_name(Damage damage) {
  switch (damage) {
    case Damage::Flip:
      return "flipped";
    case Damage::Truncate:
      return "truncated";
    case Damage::Delete:
      return "deleted";
    case Damage::Append:
      break;
  }
  return "appended to";
}

bool do_damage(const fs::path& file, Damage damage, std::uint64_t random) {
  std::error_code gone;
  const std::uintmax_t size = fs::file_size(file, gone);
  if (gone) return false;
  if (damage == Damage::Delete) return fs::remove(file, gone);
  if (damage == Damage::Append) {
    std::ofstream(file, std::ios::app | std::ios::binary) << "}x";
    return true;
  }
  if (size == 0) return false;
  const auto at = static_cast<std::streamoff>(random % size);
  if (damage == Damage::Truncate) {
    fs::resize_file(file, static_cast<std::uintmax_t>(at), gone);
    return !gone;
  }
  std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
  bytes.seekg(at);
  const int byte = bytes.get();
  bytes.seekp(at);
  bytes.put(static_cast<char>(byte ^ (1 << (random / size % 8))));
  return bytes.good();
}

std::string dataset_difference(const fs::path& job, const fs::path& complete) {
  if (!fs::exists(job / "dataset")) return "there is none";
  return first_difference(complete / "dataset", job / "dataset");
}

namespace {

/// Paths of all files below a folder; folders too, ending in "/".
std::vector<std::string> paths_below(const fs::path& folder) {
  std::vector<std::string> paths;
  if (!fs::exists(folder)) return paths;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    paths.push_back(entry.path().lexically_relative(folder).string() +
                    (entry.is_directory() ? "/" : ""));
  std::sort(paths.begin(), paths.end());
  return paths;
}

std::string joined(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts) all += " " + text;
  return all;
}

}  // namespace

std::vector<std::string> faults_of_complete_job(const fs::path& job, const fs::path& complete) {
  std::vector<std::string> faults;
  if (const std::string difference = dataset_difference(job, complete); !difference.empty())
    faults.push_back("the dataset is another: " + difference);
  const auto sums =
      run_command("/bin/sh", {"-c", "cd '" + (job / "dataset").string() +
                                        "' && sha256sum --check --strict --quiet SHA256SUMS"});
  if (sums.status != 0) faults.push_back("sha256sum: " + sums.output);

  const fs::path done = fs::path("state") / "0001" / "done";
  if (const auto found = paths_below(job / done), wanted = paths_below(complete / done);
      found != wanted)
    faults.push_back("the records of shards are" + joined(found) + "\n  where must be" +
                     joined(wanted));
  for (const std::string& path : paths_below(job))
    if (path.find(".terracast-tmp-") != std::string::npos ||
        path.find("/.new-") != std::string::npos)
      faults.push_back("left behind: " + path);
  for (const char* folder : {"attempts", "state/0001/clocks", "state/0001/claims"})
    for (const std::string& path : paths_below(job / folder))
      if (std::string(folder) == "attempts" || !path.ends_with("/"))
        faults.push_back("left behind: " + std::string(folder) + "/" + path);

  const auto status = run_program({"batch", "status", job.string(), "--json"});
  if (status.status != 0) {
    faults.push_back("status: " + status.output);
  } else if (const core::Json json = core::Json::parse(status.output, "status");
             !json.at("complete").boolean() || json.at("checks_failed").integer() != 0) {
    faults.push_back("status says: " + status.output);
  }
  return faults;
}

}  // namespace terracast::test
