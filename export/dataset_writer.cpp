#include "export/dataset_writer.h"

#include <algorithm>
#include <set>
#include <utility>

#include "capture/sequence_files.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/plugin_rows.h"
#include "core/schema_writer.h"
#include "export/imaging_record.h"
#include "export/motion_record.h"

namespace terracast::exporters {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;
using core::Json;

constexpr const char* kDatasetFile = "dataset.json";
constexpr const char* kJournalFile = "export.partial.jsonl";

void remove_file(const fs::path& file) {
  std::error_code error;
  fs::remove(file, error);
  if (error) fail(ErrorKind::Io, "{}: cannot be removed: {}", file.string(), error.message());
}

/// All below a folder that is no folder itself; links are not followed.
std::vector<fs::path> files_below(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
    if (!fs::is_directory(entry.symlink_status())) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// Folders that hold nothing, inner ones first.
void remove_empty_folders(const fs::path& folder) {
  std::vector<fs::path> folders;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
    if (fs::is_directory(entry.symlink_status())) folders.push_back(entry.path());
  std::sort(folders.rbegin(), folders.rend());
  for (const fs::path& inner : folders)
    if (fs::is_empty(inner)) remove_file(inner);
}

bool is_as_written(const fs::path& file, const DatasetFile& written) {
  std::error_code missing;
  return fs::file_size(file, missing) == written.num_bytes && !missing &&
         core::content_hash_of_file(file) == written.content_hash;
}

}  // namespace

std::string source_hash(std::string_view format, const Exporter& exporter,
                        const std::vector<capture::SequenceReader>& sequences) {
  std::string text = fmt::format("{}\n{}\n", TERRACAST_VERSION, format);
  exporter.clone()->describe(*core::make_toml_writer(text));
  for (const std::string& form : exporter.scan_forms.clouds) text += "clouds " + form + "\n";
  for (const std::string& form : exporter.scan_forms.events) text += "events " + form + "\n";
  for (const capture::SequenceReader& sequence : sequences)
    text += core::content_hash_of_file(sequence.folder() / capture::kManifestFile) + "\n";
  return core::content_hash(text + core::plugin_marks(text));
}

DatasetWriter::DatasetWriter(fs::path folder, std::string format, std::string hash,
                             const core::Context& context)
    : folder_(std::move(folder)), format_(std::move(format)), hash_(std::move(hash)) {
  core::make_folder(folder_);
  core::remove_temporaries(folder_);
  prepare(context.log);
}

void DatasetWriter::prepare(const core::Log& log) {
  const fs::path dataset_file = folder_ / kDatasetFile;
  const std::optional<DatasetRecord> begun = ExportJournal::read(folder_ / kJournalFile);
  const std::optional<DatasetRecord> finished = read_finished_record(dataset_file);
  const std::optional<DatasetRecord>& present = begun ? begun : finished;
  if (present && present->format == format_ && present->source_hash == hash_) {
    recorded_ = present->files;
    if (begun) {
      log.info("{}: taking up an unfinished export", folder_.string());
    } else {
      const std::vector<std::string> damaged = damaged_files();
      is_complete_ = damaged.empty();
      if (is_complete_) return;
      log.warn("{}: {} files are missing or damaged, such as {}; exporting them again",
               folder_.string(), damaged.size(), damaged.front());
    }
  } else {
    if (present) log.info("{}: its sources or options changed; exporting again", folder_.string());
    clear(begun, finished);
  }
  journal_.emplace(folder_ / kJournalFile,
                   DatasetRecord{.format = format_, .source_hash = hash_, .files = recorded_});
  remove_file(dataset_file);  // last: with neither of the two nobody would know whose the files are
}

std::vector<std::string> DatasetWriter::damaged_files() const {
  std::vector<std::pair<std::string, DatasetFile>> files(recorded_.begin(), recorded_.end());
  std::vector<std::uint8_t> is_sound(files.size());
  core::parallel_for(static_cast<std::int64_t>(files.size()), [&](std::int64_t i) {
    const auto& [path, written] = files[static_cast<std::size_t>(i)];
    is_sound[static_cast<std::size_t>(i)] = is_as_written(folder_ / path, written) ? 1 : 0;
  });
  std::vector<std::string> damaged;
  for (std::size_t i = 0; i < files.size(); ++i)
    if (is_sound[i] == 0) damaged.push_back(files[i].first);
  return damaged;
}

void DatasetWriter::clear(const std::optional<DatasetRecord>& begun,
                          const std::optional<DatasetRecord>& finished) {
  std::set<fs::path> ours;
  if (begun) ours.insert(folder_ / kJournalFile);
  if (finished) ours.insert(folder_ / kDatasetFile);
  for (const auto* record : {&begun, &finished})
    if (*record)
      for (const auto& [path, written] : (*record)->files) ours.insert(folder_ / path);
  const std::vector<fs::path> files = files_below(folder_);
  for (const fs::path& file : files)
    if (!ours.contains(file))
      fail(ErrorKind::Config,
           "{} holds files that no export of terracast is known to have written, such as {}: give "
           "another --out, or move them",
           folder_.string(), file.string());
  for (const fs::path& file : files)
    if (file != folder_ / kJournalFile && file != folder_ / kDatasetFile) remove_file(file);
  remove_empty_folders(folder_);
}

bool DatasetWriter::keep(const std::string& path) {
  const auto written = recorded_.find(path);
  if (written == recorded_.end() || !is_as_written(folder_ / path, written->second)) return false;
  const std::lock_guard lock(mutex_);
  files_[path] = written->second;
  return true;
}

void DatasetWriter::write(const std::string& path, std::span<const std::byte> bytes) {
  const DatasetFile file{.num_bytes = bytes.size(), .content_hash = core::content_hash(bytes)};
  journal_->add(path, file);
  if (fs::is_symlink(folder_ / path)) remove_file(folder_ / path);  // what it names is not ours
  core::write_file(folder_ / path, bytes);
  const std::lock_guard lock(mutex_);
  files_[path] = file;
}

void DatasetWriter::write(const std::string& path, std::string_view text) {
  write(path, std::as_bytes(std::span(text)));
}

void DatasetWriter::write_by(const std::string& path,
                             const std::function<void(const fs::path& temporary)>& make) {
  if (fs::is_symlink(folder_ / path)) remove_file(folder_ / path);  // what it names is not ours
  DatasetFile file;
  core::write_file_by(folder_ / path, [&](const fs::path& temporary) {
    make(temporary);
    file = {.num_bytes = fs::file_size(temporary),
            .content_hash = core::content_hash_of_file(temporary)};
    journal_->add(path, file);
  });
  const std::lock_guard lock(mutex_);
  files_[path] = file;
}

void DatasetWriter::remove_folder(const std::string& path) {
  const std::lock_guard lock(mutex_);
  for (auto* files : {&recorded_, &files_})
    std::erase_if(*files, [&](const auto& entry) {
      if (!entry.first.starts_with(path + "/")) return false;
      remove_file(folder_ / entry.first);
      return true;
    });
  if (fs::exists(folder_ / path) && fs::is_empty(folder_ / path)) remove_file(folder_ / path);
}

void DatasetWriter::finish(Json description) {
  description.set("files", json_from_files(files_));
  description.write(folder_ / kDatasetFile);
  remove_file(folder_ / kJournalFile);
}

Json metadata(std::string_view format, std::string_view format_version, const std::string& hash,
              const std::vector<capture::SequenceReader>& sequences,
              const std::vector<std::pair<std::string, std::string>>& conventions,
              const std::vector<std::string>& additions) {
  std::vector<std::string> licences;
  for (const capture::SequenceReader& sequence : sequences)
    for (const std::string& licence : sequence.info().licences)
      if (std::find(licences.begin(), licences.end(), licence) == licences.end())
        licences.push_back(licence);
  Json sentences = Json::object();
  for (const auto& [name, sentence] : conventions) sentences.set(name, sentence);
  std::vector<std::string> all_additions = {
      "dataset.json: this file",
      "georeference.csv: every camera's place on WGS84 and its rotation there",
      "bounds.csv: what depth and flow of every image may err by",
      "geometry.json: the tiles of the world that a sequence shows, with their hashes"};
  const auto any = [&](auto&& holds) {
    return std::any_of(sequences.begin(), sequences.end(),
                       [&](const capture::SequenceReader& each) { return holds(each.info()); });
  };
  if (any(has_imaging))
    all_additions.emplace_back(
        "imaging.json: how each camera was exposed, and made its images of the light");
  if (any([](const capture::SequenceInfo& info) { return info.has_rolling_shutter(); })) {
    sentences.set("shutter", shutter_convention());
    all_additions.emplace_back(
        "motion.csv: how the body moves at each frame's time, while the lines of rolling shutters "
        "are exposed");
  }
  if (any([](const capture::SequenceInfo& info) { return !info.moving.empty(); })) {
    sentences.set(
        "moving",
        "Things move: flow follows them, and masks of it say where they are seen again. Points "
        "that are tracked stand still.");
    all_additions.emplace_back(
        "moving.csv: where each thing that moves is at every frame's time, and how it goes on");
    all_additions.emplace_back(
        "moving/CAMERA/NNNNNN.png: the number of the body that each pixel shows, 16 bits; 0: it "
        "stands still");
  }
  if (any([](const capture::SequenceInfo& info) { return !info.streams.empty(); })) {
    all_additions.emplace_back(
        "sensors/RIG/NAME.csv: samples of a sensor beside cameras, each at its own time");
    all_additions.emplace_back("sensors.json: kind, channels, mount and settings of each sensor");
  }
  if (any([](const capture::SequenceInfo& info) { return info.has_errors(); })) {
    sentences.set("calibration",
                  "A sequence whose rigs have errors says which calibration and times the format's "
                  "own files state: true, or believed. Images, labels and all that is ours are of "
                  "the true cameras at the true times.");
    all_additions.emplace_back(
        "calibration_true.json, calibration_believed.json: the cameras as they are, and as they "
        "are believed to be");
  }
  if (any([](const capture::SequenceInfo& info) { return !info.clocks.empty(); }))
    all_additions.emplace_back(
        "timestamps.csv: when each image was taken, and when by the camera's own clock");
  all_additions.insert(all_additions.end(), additions.begin(), additions.end());
  const capture::SequenceInfo& info = sequences.front().info();
  Json json = Json::object();
  json.set("format", format)
      .set("format_version", format_version)
      .set("terracast_version", TERRACAST_VERSION)
      .set("source_hash", hash)
      .set("world",
           Json::object().set("name", info.world_name).set("input_hash", info.world_input_hash))
      .set("licences", Json::array_of(licences))
      .set("conventions", std::move(sentences))
      .set("additions", Json::array_of(all_additions));
  std::string made_by = fmt::format("\"{}\"\n", format);
  for (const capture::SequenceReader& sequence : sequences) made_by += sequence.info().config_toml;
  if (Json plugins = core::plugin_record(made_by); plugins.size() > 0)
    json.set("plugins", std::move(plugins));
  return json;
}

}  // namespace terracast::exporters
