#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "capture/channel.h"
#include "capture/frame.h"
#include "capture/frame_reader.h"
#include "core/choice.h"
#include "core/context.h"
#include "core/schema.h"
#include "export/scan_forms.h"

namespace terracast::exporters {

/// What a frame of an export is expected to take, for forecasts.
struct FrameSize {
  double num_pixels = 0.0;  ///< of the images that are exported
  double num_bytes = 0.0;   ///< on disk, to a third
};

/// How many points a sequence must follow for a format that shows them.
struct TrackPointsWanted {
  std::int64_t least = 0;     ///< with fewer it cannot pass its checks
  std::int64_t expected = 0;  ///< so many will do though no camera sees what another one does
};

/// One published format. The derived class holds its options, describes their keys, checks that the
/// cameras fit before anything is rendered, and writes.
class Exporter {
 public:
  virtual ~Exporter() = default;
  ScanForms scan_forms = {};  ///< every format takes them
  virtual void describe(core::SchemaVisitor& visit) = 0;
  virtual std::unique_ptr<Exporter> clone() const = 0;

  /// Names of the rigs whose cameras it writes; none: those of whichever rigs there are. Of bodies that carry
  /// different rigs those are written that carry one of them; the methods below are asked of the cameras of these.
  virtual std::vector<std::string> rigs() const = 0;
  bool takes(const std::string& rig) const;
  bool takes_any_of(const std::vector<capture::CameraCalibration>& cameras) const;

  /// Whether the format can hold what the rig records, asked before rendering starts.
  /// cameras   of all rigs of the sequence
  /// throws    Config: what the format cannot hold, and what would fit
  virtual void check(const std::vector<capture::CameraCalibration>& cameras) const = 0;

  /// Of cameras that check() lets pass.
  virtual FrameSize frame_size(const std::vector<capture::CameraCalibration>& cameras) const = 0;

  /// cameras   as above
  virtual TrackPointsWanted track_points_wanted(
      const std::vector<capture::CameraCalibration>& cameras, std::int64_t num_frames) const {
    (void)cameras;
    (void)num_frames;
    return {};
  }

  /// Images of a sequence that it cannot do without, of all cameras that it takes together.
  virtual std::int64_t least_images() const { return 0; }

  /// Bits of the capture's flags that it needs, by groups. Bounds of labels hold beside edges alone, so
  /// what is checked needs these.
  virtual std::uint32_t flags() const { return capture::kEdge; }

  /// Kinds of labels (`terracast list labels`) that it needs of every sequence beside the capture.
  virtual std::vector<std::string> labels() const { return {}; }

  /// Writes the sequences into `folder` (the root of one dataset of the format). Parallel over
  /// frames; finished files whose sources did not change are kept; `dataset.json` is written last.
  /// throws   Config, Input: a modality that the format cannot hold truthfully (names frame, pixel,
  ///          value); Io
  virtual void write(const std::vector<capture::SequenceReader>& sequences,
                     const std::filesystem::path& folder, const core::Context& context) const = 0;
};

struct ExporterInfo {
  std::string_view name;
  std::string_view summary;
  std::unique_ptr<Exporter> (*make)();
};

/// The table of exporters, alphabetical.
std::span<const ExporterInfo> exporters();

/// An `[[exports]]` of a config: the format, and the format's own keys beside it.
struct ExportOptions {
  std::string format;

  void describe(core::SchemaVisitor& visit);
  const Exporter& exporter() const { return *exporter_; }

 private:
  ScanForms scan_forms_;
  core::KindOptions<ExporterInfo> exporter_;
};

/// The cameras of a sequence, by its name.
struct SequenceCameras {
  std::string name;
  std::vector<capture::CameraCalibration> cameras;
};

/// Whether all formats can hold the sequences of a job, asked before rendering starts.
/// throws   Config: a format names a rig that no sequence has; as Exporter::check of the sequences that it takes; the
///          message names the format
void check_formats(const std::vector<ExportOptions>& exports,
                   const std::vector<SequenceCameras>& sequences);

/// A sequence that a job wants exported, and the config that it must have been captured with.
struct WantedSequence {
  std::string name;
  std::string config_toml;
};

/// Opens the wanted sequences of a capture, by name in alphabetical order; others that lie there
/// are left out, and named in the log.
/// throws   Config: a sequence was captured with another config; Input: not captured, unfinished or
///          damaged; Io
std::vector<capture::SequenceReader> open_sequences(const std::filesystem::path& capture_folder,
                                                    std::vector<WantedSequence> wanted,
                                                    const core::Log& log);

/// Exports sequences into `<out>/<format>` for each of the options. Those that have none of the rigs that a format
/// names are left out of it, and named in the log.
/// throws   as check_formats and Exporter::write; the message names the format
void run_export_stage(const std::vector<capture::SequenceReader>& sequences,
                      const std::vector<ExportOptions>& exports,
                      const std::filesystem::path& out_folder, const core::Context& context);

}  // namespace terracast::exporters
