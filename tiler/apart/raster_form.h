#pragma once

#include <gdal_priv.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/unnamed_file.h"
#include "tiler/apart/crs_form.h"

namespace terracast::tiler {

template <>
inline constexpr std::int32_t kLargestOf<GDALDataType> = GDT_TypeCount - 1;
template <>
inline constexpr std::int32_t kLargestOf<GDALColorInterp> = GCI_Max;
template <>
inline constexpr std::int32_t kLargestOf<GDALPaletteInterp> = GPI_HLS;

/// Samples of one type in blocks from the north-west, rows of blocks from the north; those at the edges go beyond it.
struct PlaneForm {
  GDALDataType type = GDT_Unknown;
  std::int32_t block_width = 0;
  std::int32_t block_height = 0;
  /// Blocks that GDAL could not read, by number, ascending, and why.
  struct Unread {
    std::int64_t first = 0;
    std::int64_t count = 0;
    std::string why;
    template <class Visitor>
    void describe(Visitor& visit) {
      visit(first), visit(count), visit(why);
    }
  };
  std::vector<Unread> unread;
  template <class Visitor>
  void describe(Visitor& visit) {
    visit(type), visit(block_width), visit(block_height), visit(unread);
  }

  std::uint64_t block_bytes() const;
};

struct MetadataForm {
  std::string domain;
  std::vector<std::string> items;
  template <class Visitor>
  void describe(Visitor& visit) {
    visit(domain), visit(items);
  }
};

struct ColourForm {
  std::array<std::int16_t, 4> channels = {};
  template <class Visitor>
  void describe(Visitor& visit) {
    for (std::int16_t& one : channels) visit(one);
  }
};

struct BandForm {
  std::string description;
  std::string unit;
  std::optional<double> no_data;
  std::optional<std::int64_t> signed_no_data;     ///< of bands of 64-bit numbers
  std::optional<std::uint64_t> unsigned_no_data;  ///< of those without sign
  std::optional<double> scale;
  std::optional<double> offset;
  GDALColorInterp interpretation = GCI_Undefined;
  std::optional<GDALPaletteInterp> palette;  ///< of the colours; nothing: there is no table of them
  std::vector<ColourForm> colours;
  std::optional<std::vector<std::string>> categories;
  bool has_attribute_table = false;  ///< of which nothing is asked but whether there is one
  std::int32_t num_overviews = 0;    ///< of which none is read
  std::int32_t mask_flags = GMF_ALL_VALID;
  std::int32_t mask_plane = -1;  ///< -1: the mask follows from the rest
  std::vector<MetadataForm> metadata;
  template <class Visitor>
  void describe(Visitor& visit) {
    visit(description), visit(unit), visit(no_data), visit(signed_no_data), visit(unsigned_no_data);
    visit(scale), visit(offset), visit(interpretation), visit(palette), visit(colours);
    visit(categories), visit(has_attribute_table), visit(num_overviews), visit(mask_flags);
    visit(mask_plane), visit(metadata);
  }
};

struct PlacesForm {
  std::array<double, 6> geotransform = {};
  template <class Visitor>
  void describe(Visitor& visit) {
    for (double& one : geotransform) visit(one);
  }
};

/// All that this program looks at of a raster, as a process of its own has read it. Its samples are in a file beside the
/// form: those of all planes block by block where the planes' blocks are alike, else plane by plane.
struct RasterForm {
  std::string format;  ///< GDAL's name of it
  std::string description;
  FileNames files;  ///< whose bytes it follows from
  std::int32_t width = 0;
  std::int32_t height = 0;
  std::optional<PlacesForm> places;
  std::optional<CrsForm> crs;
  std::int32_t num_control_points = 0;  ///< of which nothing is asked but how many there are
  std::vector<MetadataForm> metadata;
  std::vector<BandForm> bands;
  std::vector<PlaneForm> planes;  ///< of the bands, then masks
  SaidForm said;                  ///< at opening
  template <class Visitor>
  void describe(Visitor& visit) {
    visit(format), visit(description), visit(files), visit(width), visit(height), visit(places);
    visit(crs), visit(num_control_points), visit(metadata), visit(bands), visit(planes),
        visit(said);
  }

  std::int64_t blocks_across(const PlaneForm& plane) const;
  std::int64_t blocks_down(const PlaneForm& plane) const;
  bool has_blocks_alike() const;
  /// Where a block begins in the file of samples.
  std::uint64_t place_of(std::size_t plane, std::int64_t block) const;
  /// Bytes of all samples, as a number that cannot overflow.
  double samples_bytes() const;
};

/// Samples of a raster may take so much: 32 billion heights of 16 bits.
inline constexpr std::uint64_t kMostSamplesBytes = std::uint64_t{64} << 30;

/// What RasterForm says holds together: sizes, types, blocks, masks, and the length of the file of samples.
/// throws   Input: it does not
void check_raster_form(const RasterForm& form, std::uint64_t file_bytes, const std::string& file);

/// A raster that was read apart.
struct KeptRaster {
  RasterForm form;
  core::UnnamedFile samples;
};

}  // namespace terracast::tiler
