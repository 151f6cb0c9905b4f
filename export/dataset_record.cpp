#include "export/dataset_record.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string_view>
#include <system_error>

#include "core/atomic_file.h"
#include "core/error.h"

namespace terracast::exporters {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;
using core::Json;

Json json_from_file(const DatasetFile& file) {
  return Json::object().set("bytes", file.num_bytes).set("xxh3_128", file.content_hash);
}

DatasetFile file_from_json(const Json& json) {
  return {.num_bytes = static_cast<std::uint64_t>(json.at("bytes").integer()),
          .content_hash = json.at("xxh3_128").string()};
}

std::string header_line(const DatasetRecord& record) {
  return Json::object()
             .set("format", record.format)
             .set("source_hash", record.source_hash)
             .text(-1) +
         "\n";
}

std::string file_line(const std::string& path, const DatasetFile& file) {
  return json_from_file(file).set("path", path).text(-1) + "\n";
}

/// Whether a path, as written and after every link, stays below the folder.
bool is_inside(const fs::path& folder, const std::string& path) {
  const fs::path relative(path);
  if (path.empty() || relative.is_absolute()) return false;
  for (const fs::path& part : relative)
    if (part.empty() || part == "." || part == "..") return false;
  const fs::path root = fs::canonical(folder);
  const fs::path parent = fs::weakly_canonical(root / relative.parent_path());
  return std::mismatch(root.begin(), root.end(), parent.begin(), parent.end()).first == root.end();
}

/// A record may have come from anywhere: nothing outside its folder is ever touched for it.
void check_paths(const DatasetRecord& record, const fs::path& file) {
  for (const auto& [path, written] : record.files)
    if (!is_inside(file.parent_path(), path))
      fail(ErrorKind::Input, "{}: the path \"{}\" leaves the dataset", file.string(), path);
}

/// What `read` makes of a file; nothing where there is none, or it is damaged.
template <class Read>
std::optional<DatasetRecord> read_if_sound(const fs::path& file, Read&& read) {
  if (!fs::exists(file)) return std::nullopt;
  DatasetRecord record;
  try {
    record = read();
  } catch (const core::Error& error) {
    if (error.kind() != ErrorKind::Input) throw;
    return std::nullopt;
  }
  check_paths(record, file);
  return record;
}

}  // namespace

Json json_from_files(const std::map<std::string, DatasetFile>& files) {
  Json json = Json::object();
  for (const auto& [path, file] : files) json.set(path, json_from_file(file));
  return json;
}

std::optional<DatasetRecord> read_finished_record(const fs::path& dataset_file) {
  return read_if_sound(dataset_file, [&] {
    const Json json = Json::read(dataset_file, Json::kMostOfDatasets);
    DatasetRecord record{.format = json.at("format").string(),
                         .source_hash = json.at("source_hash").string(),
                         .files = {}};
    for (const auto& [path, file] : json.at("files").members())
      record.files[path] = file_from_json(file);
    return record;
  });
}

ExportJournal::ExportJournal(const fs::path& file, const DatasetRecord& record) : file_(file) {
  std::string text = header_line(record);
  for (const auto& [path, written] : record.files) text += file_line(path, written);
  core::write_file(file_, text);
  descriptor_ = ::open(file_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (descriptor_ < 0)
    fail(ErrorKind::Io, "{}: cannot be written: {}", file_.string(),
         std::error_code(errno, std::generic_category()).message());
}

ExportJournal::~ExportJournal() { ::close(descriptor_); }

void ExportJournal::add(const std::string& path, const DatasetFile& file) {
  const std::string line = file_line(path, file);
  // One write(): with O_APPEND the lines of several threads do not mix.
  if (::write(descriptor_, line.data(), line.size()) != static_cast<ssize_t>(line.size()))
    fail(ErrorKind::Io, "{}: cannot be written: {}", file_.string(),
         std::error_code(errno, std::generic_category()).message());
}

std::optional<DatasetRecord> ExportJournal::read(const fs::path& file) {
  return read_if_sound(file, [&] {
    const std::string text = core::read_text_file(file);
    std::size_t begin = 0;
    const auto next_line = [&]() -> std::optional<Json> {
      const std::size_t end = text.find('\n', begin);
      if (end == std::string::npos) return std::nullopt;
      const std::string_view line = std::string_view(text).substr(begin, end - begin);
      begin = end + 1;
      return Json::parse(line, file.string());
    };
    const std::optional<Json> header = next_line();
    if (!header) fail(ErrorKind::Input, "{}: cut off", file.string());
    DatasetRecord record{.format = header->at("format").string(),
                         .source_hash = header->at("source_hash").string(),
                         .files = {}};
    try {
      while (const std::optional<Json> line = next_line())
        record.files[line->at("path").string()] = file_from_json(*line);
    } catch (const core::Error& error) {
      if (error.kind() != ErrorKind::Input) throw;  // damaged: the rest is not known
    }
    return record;
  });
}

}  // namespace terracast::exporters
