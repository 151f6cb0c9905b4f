#include "export/dataset_writer.h"

#include <algorithm>
#include <optional>

#include "capture/manifest.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/log.h"
#include "core/schema_writer.h"

namespace terracast::exporters {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;
using core::Json;

constexpr const char* kDatasetFile = "dataset.json";
constexpr const char* kPartialFile = "export.partial.json";

/// A path of a dataset.json, which may have come from anywhere: nothing outside the folder is
/// touched for it.
bool is_inside(const std::string& path) {
  const fs::path p(path);
  return !path.empty() && !p.is_absolute() &&
         std::none_of(p.begin(), p.end(), [](const fs::path& part) { return part == ".."; });
}

void remove_path(const fs::path& file) {
  std::error_code error;
  fs::remove_all(file, error);
  if (error) fail(ErrorKind::Io, "{}: cannot be removed: {}", file.string(), error.message());
}

std::vector<fs::path> files_below(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
    if (!entry.is_directory()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// Folders that hold nothing, inner ones first.
void remove_empty_folders(const fs::path& folder) {
  std::vector<fs::path> folders;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_directory()) folders.push_back(entry.path());
  std::sort(folders.rbegin(), folders.rend());
  for (const fs::path& inner : folders)
    if (fs::is_empty(inner)) remove_path(inner);
}

/// A JSON file that an earlier run wrote; nothing when there is none or it is damaged.
std::optional<Json> read_if_sound(const fs::path& file) {
  if (!fs::exists(file)) return std::nullopt;
  try {
    Json json = Json::read(file);
    json.at("format").string();
    json.at("source_hash").string();
    return json;
  } catch (const core::Error& error) {
    if (error.kind() != ErrorKind::Input) throw;
    return std::nullopt;
  }
}

}  // namespace

std::string source_hash(std::string_view format, const Exporter& exporter,
                        const std::vector<capture::SequenceReader>& sequences) {
  std::string text = fmt::format("{}\n{}\n", TERRACAST_VERSION, format);
  exporter.clone()->describe(*core::make_toml_writer(text));
  for (const capture::SequenceReader& sequence : sequences)
    text += core::content_hash_of_file(sequence.folder() / capture::kManifestFile) + "\n";
  return core::content_hash(text);
}

DatasetWriter::DatasetWriter(fs::path folder, std::string format, std::string hash,
                             const core::Context& context)
    : folder_(std::move(folder)), format_(std::move(format)), hash_(std::move(hash)) {
  core::make_folder(folder_);
  core::remove_temporaries(folder_);
  prepare(context.log);
  if (is_complete_) return;
  Json::object().set("format", format_).set("source_hash", hash_).write(folder_ / kPartialFile);
}

void DatasetWriter::prepare(const core::Log& log) {
  const fs::path partial_file = folder_ / kPartialFile;
  const fs::path dataset_file = folder_ / kDatasetFile;
  const auto is_ours = [&](const Json& json) {
    return json.at("format").string() == format_ && json.at("source_hash").string() == hash_;
  };
  if (fs::exists(partial_file)) {
    const std::optional<Json> partial = read_if_sound(partial_file);
    is_resumed_ = partial && is_ours(*partial);
    if (is_resumed_) {
      log.info("{}: taking up an unfinished export", folder_.string());
    } else {
      log.info("{}: clearing an unfinished export of other sources", folder_.string());
      for (const fs::path& file : files_below(folder_)) remove_path(file);
      remove_empty_folders(folder_);
    }
    return;
  }
  const std::optional<Json> dataset = read_if_sound(dataset_file);
  if (!dataset) {
    const std::vector<fs::path> present = files_below(folder_);
    if (!present.empty())
      fail(ErrorKind::Config,
           "{} holds files that no export of terracast finished, such as {}: give another --out, "
           "or remove them",
           folder_.string(), present.front().string());
    return;
  }
  if (!is_ours(*dataset)) {
    log.info("{}: its sources or options changed; exporting again", folder_.string());
    clear_finished(*dataset);
    return;
  }
  std::vector<fs::path> damaged;
  for (const auto& [path, record] : dataset->at("files").members()) {
    std::error_code missing;
    const std::uintmax_t size = fs::file_size(folder_ / path, missing);
    if (missing || static_cast<std::int64_t>(size) != record.at("bytes").integer())
      damaged.push_back(folder_ / path);
  }
  is_complete_ = damaged.empty();
  if (is_complete_) return;
  log.warn("{}: {} files are missing or damaged, such as {}; exporting them again",
           folder_.string(), damaged.size(), damaged.front().string());
  for (const fs::path& file : damaged) remove_path(file);
  remove_path(dataset_file);
  is_resumed_ = true;
}

void DatasetWriter::clear_finished(const Json& dataset) {
  for (const auto& [path, record] : dataset.at("files").members()) {
    if (!is_inside(path))
      fail(ErrorKind::Input, "{}: the path \"{}\" leaves the dataset",
           (folder_ / kDatasetFile).string(), path);
    remove_path(folder_ / path);
  }
  remove_empty_folders(folder_);
  for (const fs::path& file : files_below(folder_))
    if (file != folder_ / kDatasetFile)
      fail(ErrorKind::Config,
           "{} was not written by the export there: give another --out, or move it", file.string());
  remove_path(folder_ / kDatasetFile);
}

bool DatasetWriter::keep(const std::string& path) {
  if (!is_resumed_ || !fs::exists(folder_ / path)) return false;
  const std::vector<std::byte> bytes = core::read_file(folder_ / path);
  const std::string hash = core::content_hash(bytes);
  const std::lock_guard lock(mutex_);
  files_[path] = {bytes.size(), hash};
  return true;
}

void DatasetWriter::write(const std::string& path, std::span<const std::byte> bytes) {
  core::write_file(folder_ / path, bytes);
  const std::string hash = core::content_hash(bytes);
  const std::lock_guard lock(mutex_);
  files_[path] = {bytes.size(), hash};
}

void DatasetWriter::write(const std::string& path, std::string_view text) {
  write(path, std::as_bytes(std::span(text)));
}

void DatasetWriter::remove_folder(const std::string& path) {
  const std::lock_guard lock(mutex_);
  std::erase_if(files_, [&](const auto& entry) { return entry.first.starts_with(path + "/"); });
  remove_path(folder_ / path);
}

void DatasetWriter::finish(Json description) {
  Json files = Json::object();
  for (const auto& [path, written] : files_)
    files.set(path, Json::object().set("bytes", written.num_bytes).set("xxh3_128", written.hash));
  description.set("files", std::move(files));
  description.write(folder_ / kDatasetFile);
  remove_path(folder_ / kPartialFile);
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
  const capture::SequenceInfo& info = sequences.front().info();
  return Json::object()
      .set("format", format)
      .set("format_version", format_version)
      .set("terracast_version", TERRACAST_VERSION)
      .set("source_hash", hash)
      .set("world",
           Json::object().set("name", info.world_name).set("input_hash", info.world_input_hash))
      .set("licences", Json::array_of(licences))
      .set("conventions", std::move(sentences))
      .set("additions", Json::array_of(additions));
}

}  // namespace terracast::exporters
