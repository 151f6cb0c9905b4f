#include <algorithm>
#include <map>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"
#include "core/log.h"
#include "core/schema_writer.h"
#include "core/toml_reader.h"
#include "export/dataset_writer.h"
#include "plugins/laws/laws.h"

namespace terracast::plugins {
namespace {

namespace fs = std::filesystem;
using Hashes = std::map<std::string, std::string>;

class ExporterLaws {
 public:
  ExporterLaws(const exporters::ExportOptions& options, const fs::path& captures,
               const fs::path& folder, LawReport& report)
      : options_(options), captures_(captures), folder_(folder), report_(report) {}

  void try_all() {
    options_read_back();
    no_cameras_are_refused();
    whole_ = export_into("one", 1);
    record_lists_what_there_is();
    threads_do_not_matter();
    a_finished_dataset_is_kept();
    one_that_was_cut_off_is_completed();
    damage_of_its_source_ends_it();
  }

 private:
  std::vector<capture::SequenceReader> sequences(const fs::path& captures) const {
    std::vector<capture::SequenceReader> all;
    for (const auto& entry : fs::directory_iterator(captures))
      if (fs::exists(entry.path() / "sequence.json"))
        all.push_back(capture::SequenceReader::open(entry.path()));
    std::sort(all.begin(), all.end(),
              [](const auto& a, const auto& b) { return a.info().name < b.info().name; });
    return all;
  }

  fs::path dataset(const std::string& name) const { return folder_ / name / options_.format; }

  Hashes export_into(const std::string& name, int num_threads) {
    exporters::run_export_stage(sequences(captures_), {options_}, folder_ / name,
                                {.log = quiet_, .num_threads = num_threads});
    return hashes(dataset(name));
  }

  static Hashes hashes(const fs::path& folder) {
    Hashes all;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (entry.is_regular_file())
        all[fs::relative(entry.path(), folder).string()] = core::content_hash_of_file(entry.path());
    return all;
  }

  void expect_same(const Hashes& hashes, const std::string& when) {
    for (const auto& [file, hash] : whole_) {
      const auto other = hashes.find(file);
      report_.expect(other != hashes.end(), file + " is missing " + when);
      if (other != hashes.end())
        report_.expect(other->second == hash, file + " has other bytes " + when);
    }
    for (const auto& [file, hash] : hashes)
      report_.expect(whole_.contains(file), file + " is there " + when + ", and else not");
  }

  void options_read_back() {
    report_.begin("its options read back, and copies are their own");
    const std::string text = core::toml_text(options_);
    exporters::ExportOptions again;
    core::TomlDocument::parse(text, "options").read(again);
    report_.expect(core::toml_text(again) == text, "other options come back");
    const exporters::ExportOptions copy = options_;
    report_.expect(core::toml_text(copy) == text && &copy.exporter() != &options_.exporter(),
                   "a copy is another, or the same object");
  }

  void no_cameras_are_refused() {
    report_.begin("a rig without cameras is refused before anything is rendered");
    try {
      options_.exporter().check({});
      report_.broken("check takes it");
    } catch (const core::Error& error) {
      report_.expect(error.kind() == core::ErrorKind::Config,
                     std::string("another kind of error: ") + error.what());
    }
    report_.begin("the size that it forecasts is a number of bytes");
    for (const capture::SequenceReader& sequence : sequences(captures_)) {
      const exporters::FrameSize size = options_.exporter().frame_size(sequence.info().cameras);
      report_.expect(size.num_bytes >= 0.0 && size.num_pixels >= 0.0 && size.num_bytes < 1e15,
                     fmt::format("{} bytes, {} pixels", size.num_bytes, size.num_pixels));
    }
  }

  void record_lists_what_there_is() {
    report_.begin("dataset.json lists exactly the files that are there");
    report_.expect(fs::exists(dataset("one") / "dataset.json"), "there is no dataset.json");
    if (!report_.holds()) return;
    const core::Json record = core::Json::read(dataset("one") / "dataset.json");
    Hashes listed;
    for (const auto& [path, file] : record.at("files").members())
      listed[path] = file.at("xxh3_128").string();
    for (const auto& [path, hash] : whole_)
      report_.expect(path == "dataset.json" || (listed.contains(path) && listed.at(path) == hash),
                     path + " is not listed, or as another");
    for (const auto& [path, hash] : listed)
      report_.expect(whole_.contains(path), path + " is listed, and not there");
    report_.expect(record.at("format").string() == options_.format, "it names another format");
    report_.expect(
        record.at("source_hash").string() ==
            exporters::source_hash(options_.format, options_.exporter(), sequences(captures_)),
        "its source_hash is not that of its format's name, options and sequences: an "
        "edited plug-in would go unnoticed");
  }

  void threads_do_not_matter() {
    report_.begin("the same bytes from one thread and from four");
    expect_same(export_into("four", 4), "from four threads");
  }

  void a_finished_dataset_is_kept() {
    report_.begin("a finished dataset is kept as it is");
    std::map<std::string, fs::file_time_type> times;
    for (const auto& [file, hash] : whole_)
      times[file] = fs::last_write_time(dataset("one") / file);
    expect_same(export_into("one", 2), "after a second export");
    for (const auto& [file, time] : times)
      report_.expect(fs::last_write_time(dataset("one") / file) == time, file + " is written anew");
  }

  /// As a kill leaves it: no dataset.json, a journal, and some of the files.
  void one_that_was_cut_off_is_completed() {
    report_.begin("an export that was cut off is completed to the same bytes");
    const fs::path root = dataset("four");
    const core::Json record = core::Json::read(root / "dataset.json");
    std::string journal = core::Json::object()
                              .set("format", record.at("format").string())
                              .set("source_hash", record.at("source_hash").string())
                              .text(-1) +
                          "\n";
    for (const auto& [path, file] : record.at("files").members())
      journal += core::Json(file).set("path", path).text(-1) + "\n";
    core::write_file(root / "export.partial.jsonl", journal);
    fs::remove(root / "dataset.json");
    std::size_t i = 0;
    for (const auto& [path, hash] : whole_)
      if (path != "dataset.json" && ++i % 2 == 0) fs::remove(root / path);
    expect_same(export_into("four", 2), "after it was cut off");
  }

  void damage_of_its_source_ends_it() {
    report_.begin("a damaged image of the capture ends the export, and no dataset.json is left");
    const fs::path copy = folder_ / "damaged_capture";
    fs::copy(captures_, copy, fs::copy_options::recursive);
    for (const auto& entry : fs::recursive_directory_iterator(copy)) {
      if (entry.path().extension() != ".exr" && entry.path().extension() != ".png") continue;
      std::vector<std::byte> bytes = core::read_file(entry.path());
      bytes[bytes.size() / 2] ^= std::byte{1};
      core::write_file(entry.path(), bytes);
    }
    try {
      exporters::run_export_stage(sequences(copy), {options_}, folder_ / "damaged",
                                  {.log = quiet_, .num_threads = 2});
      // A format without images has read none.
      const bool has_images = std::any_of(whole_.begin(), whole_.end(), [](const auto& file) {
        const std::string extension = fs::path(file.first).extension().string();
        return extension == ".png" || extension == ".exr" || extension == ".npy" ||
               extension == ".jpg";
      });
      report_.expect(!has_images, "it writes images of a damaged capture");
    } catch (const core::Error& error) {
      report_.expect(error.kind() == core::ErrorKind::Input,
                     std::string("another kind of error: ") + error.what());
      report_.expect(!fs::exists(dataset("damaged") / "dataset.json"), "dataset.json is there");
    }
  }

  const exporters::ExportOptions& options_;
  fs::path captures_, folder_;
  LawReport& report_;
  core::Log quiet_{"laws", core::LogLevel::Off};
  Hashes whole_;
};

}  // namespace

void try_exporter(const exporters::ExportOptions& options, const fs::path& captures,
                  const fs::path& folder, LawReport& report) {
  ExporterLaws(options, captures, folder, report).try_all();
}

}  // namespace terracast::plugins
