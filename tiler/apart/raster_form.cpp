#include "tiler/apart/raster_form.h"

#include <algorithm>

#include "core/error.h"
#include "tiler/apart/form_io.h"

namespace terracast::tiler {
namespace {

constexpr double kMostBlockBytes = 1 << 30;
constexpr std::size_t kMostBands = 65536;

std::int64_t parts_of(std::int32_t whole, std::int32_t part) {
  return (std::int64_t{whole} + part - 1) / part;
}

const char* fault_of(const RasterForm& form, const PlaneForm& plane) {
  if (plane.type <= GDT_Unknown || plane.type >= GDT_TypeCount ||
      GDALGetDataTypeSizeBytes(plane.type) <= 0)
    return "its samples are of no type";
  if (plane.block_width < 1 || plane.block_height < 1) return "its blocks have no size";
  if (double{1} * plane.block_width * plane.block_height * GDALGetDataTypeSizeBytes(plane.type) >
      kMostBlockBytes)
    return "its blocks take more than 1 GiB";
  const std::int64_t num_blocks = form.blocks_across(plane) * form.blocks_down(plane);
  std::int64_t free_from = 0;
  for (const PlaneForm::Unread& run : plane.unread) {
    if (run.first < free_from || run.count < 1 || run.first >= num_blocks ||
        run.count > num_blocks - run.first)
      return "it names blocks that it does not have";
    free_from = run.first + run.count;
  }
  return nullptr;
}

const char* fault_of(const RasterForm& form, std::uint64_t file_bytes) {
  if (form.width < 1 || form.height < 1) return "it has no samples";
  if (form.bands.empty() || form.bands.size() > kMostBands ||
      form.planes.size() < form.bands.size() || form.planes.size() > 2 * form.bands.size())
    return "its bands are not as many as its planes";
  for (const PlaneForm& plane : form.planes)
    if (const char* fault = fault_of(form, plane)) return fault;
  for (const BandForm& band : form.bands) {
    const bool has_plane = band.mask_plane >= 0;
    const auto plane = static_cast<std::size_t>(band.mask_plane);
    if (has_plane && (plane < form.bands.size() || plane >= form.planes.size()))
      return "it names masks that it does not have";
    if (has_plane && form.planes[plane].type != GDT_Byte) return "its masks are no bytes";
    if (!band.palette && !band.colours.empty()) return "it has colours without a table";
    if (band.num_overviews < 0 || form.num_control_points < 0) return "it counts below 0";
  }
  if (form.samples_bytes() > static_cast<double>(kMostSamplesBytes))
    return "its samples take more than they may";
  const PlaneForm& last = form.planes.back();
  const std::int64_t num_blocks = form.blocks_across(last) * form.blocks_down(last);
  const std::uint64_t end =
      form.place_of(form.planes.size() - 1, num_blocks - 1) + last.block_bytes();
  if (end != file_bytes) return "its samples are not as many as it says";
  return nullptr;
}

}  // namespace

std::uint64_t PlaneForm::block_bytes() const {
  return static_cast<std::uint64_t>(block_width) * static_cast<std::uint64_t>(block_height) *
         static_cast<std::uint64_t>(GDALGetDataTypeSizeBytes(type));
}

std::int64_t RasterForm::blocks_across(const PlaneForm& plane) const {
  return parts_of(width, plane.block_width);
}
std::int64_t RasterForm::blocks_down(const PlaneForm& plane) const {
  return parts_of(height, plane.block_height);
}

bool RasterForm::has_blocks_alike() const {
  return std::all_of(planes.begin(), planes.end(), [&](const PlaneForm& plane) {
    return plane.block_width == planes.front().block_width &&
           plane.block_height == planes.front().block_height;
  });
}

std::uint64_t RasterForm::place_of(std::size_t plane, std::int64_t block) const {
  const auto number = static_cast<std::uint64_t>(block);
  const bool is_alike = has_blocks_alike();
  std::uint64_t before = 0;  // bytes of other planes' samples
  for (std::size_t other = 0; other < planes.size(); ++other) {
    const PlaneForm& one = planes[other];
    const auto num_blocks = static_cast<std::uint64_t>(blocks_across(one) * blocks_down(one));
    if (is_alike)
      before += other == plane ? 0 : (number + (other < plane ? 1 : 0)) * one.block_bytes();
    else if (other < plane)
      before += num_blocks * one.block_bytes();
  }
  return before + number * planes[plane].block_bytes();
}

double RasterForm::samples_bytes() const {
  double bytes = 0.0;
  for (const PlaneForm& plane : planes)
    bytes += static_cast<double>(blocks_across(plane)) * static_cast<double>(blocks_down(plane)) *
             static_cast<double>(plane.block_bytes());
  return bytes;
}

void check_raster_form(const RasterForm& form, std::uint64_t file_bytes, const std::string& file) {
  if (const char* fault = fault_of(form, file_bytes))
    core::fail(core::ErrorKind::Input, "{}: damaged: {}; {}", file, fault, kFormWayOut);
}

}  // namespace terracast::tiler
