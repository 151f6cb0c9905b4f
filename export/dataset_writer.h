#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "capture/frame_reader.h"
#include "core/context.h"
#include "core/json.h"
#include "export/dataset_record.h"
#include "export/exporter.h"

namespace terracast::exporters {

/// Hash of all that determines a dataset: the program's version, the exporter's options, and each
/// sequence's manifest (which holds the hash of everything captured).
/// format   the kind's name: by it an edited plug-in is noticed
std::string source_hash(std::string_view format, const Exporter& exporter,
                        const std::vector<capture::SequenceReader>& sequences);

/// Writes the files of one dataset and remembers size and hash of each for dataset.json, which is
/// written last: a dataset is finished when that exists. Until then `export.partial.jsonl` says
/// from which sources it is being made and which files it wrote: a run that was killed is taken up,
/// one from other sources is cleared away first. A file is kept only while its hash is the recorded
/// one.
/// threads   write, write_by, keep and write_kept are safe
class DatasetWriter {
 public:
  /// cost     of a finished dataset every file is read once
  /// throws   Config: the folder holds files that no export wrote; Input: a record names a file
  ///          outside the folder; Io. Nothing is changed then
  DatasetWriter(std::filesystem::path folder, std::string format, std::string hash,
                const core::Context& context);

  /// Whether a finished dataset of the same sources was found, with all its files whole: there is
  /// nothing to do.
  bool is_complete() const { return is_complete_; }

  /// Takes over a file that an earlier run finished.
  /// returns   whether there is one, to the byte as it was written
  bool keep(const std::string& path);
  void write(const std::string& path, std::span<const std::byte> bytes);
  void write(const std::string& path, std::string_view text);
  /// keep(), or else write() of what `make` returns.
  template <class Make>
  void write_kept(const std::string& path, Make&& make) {
    if (!keep(path)) write(path, make());
  }
  /// Writes a file that need not fit in memory.
  /// make     writes it whole to the path that it is given, which lies beside the file's own
  /// throws   Io; what `make` throws: then no file is left
  void write_by(const std::string& path,
                const std::function<void(const std::filesystem::path& temporary)>& make);
  /// Takes files back: a modality turned out to be one that the format cannot hold.
  void remove_folder(const std::string& path);

  /// Writes dataset.json.
  /// description   its members but "files": begins with what metadata() gives
  void finish(core::Json description);

 private:
  void prepare(const core::Log& log);
  std::vector<std::string> damaged_files() const;
  void clear(const std::optional<DatasetRecord>& begun,
             const std::optional<DatasetRecord>& finished);

  std::filesystem::path folder_;
  std::string format_;
  std::string hash_;
  bool is_complete_ = false;
  std::map<std::string, DatasetFile> recorded_;  ///< by an earlier run of the same sources
  std::optional<ExportJournal> journal_;
  std::mutex mutex_;
  std::map<std::string, DatasetFile> files_;
};

/// What every dataset.json begins with.
/// conventions   name and one sentence each
/// additions     the format's own beside those of every dataset (additions.h)
core::Json metadata(std::string_view format, std::string_view format_version,
                    const std::string& hash, const std::vector<capture::SequenceReader>& sequences,
                    const std::vector<std::pair<std::string, std::string>>& conventions,
                    const std::vector<std::string>& additions);

}  // namespace terracast::exporters
