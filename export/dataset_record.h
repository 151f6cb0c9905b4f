#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "core/json.h"

namespace terracast::exporters {

/// What a file of a dataset was when it was written.
struct DatasetFile {
  std::uint64_t num_bytes = 0;
  std::string content_hash;
  bool operator==(const DatasetFile&) const = default;
};

/// The files that an export wrote, or was about to write, by their path in the dataset.
struct DatasetRecord {
  std::string format;
  std::string source_hash;
  std::map<std::string, DatasetFile> files;
  bool operator==(const DatasetRecord&) const = default;
};

/// The member "files" of dataset.json.
core::Json json_from_files(const std::map<std::string, DatasetFile>& files);

/// The record of a finished dataset: dataset.json.
/// returns   nothing where there is none, or it is damaged
/// throws    Input: a path leaves the dataset's folder; Io
std::optional<DatasetRecord> read_finished_record(const std::filesystem::path& dataset_file);

/// The record of an export that is under way: one line of JSON for what it is made from, and one
/// for each file, written before the file is. Whatever lies in the folder of a killed export and is
/// not in its journal is somebody else's.
class ExportJournal {
 public:
  /// Replaces the journal by one that holds `record`.
  /// throws   Io
  ExportJournal(const std::filesystem::path& file, const DatasetRecord& record);
  ~ExportJournal();
  ExportJournal(const ExportJournal&) = delete;
  ExportJournal& operator=(const ExportJournal&) = delete;

  /// A file that is written next.
  /// throws    Io
  /// threads   safe
  void add(const std::string& path, const DatasetFile& file);

  /// The journal that a killed export left; of a line that was cut off, and what follows it,
  /// nothing is known.
  /// returns   nothing where there is none, or its first line is damaged
  /// throws    Input: a path leaves the dataset's folder; Io
  static std::optional<DatasetRecord> read(const std::filesystem::path& file);

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
};

}  // namespace terracast::exporters
