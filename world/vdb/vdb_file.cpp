#include "world/vdb/vdb_file.h"

#include <fmt/format.h>
#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/io.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <openvdb/tools/Interpolation.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>

#include "core/error.h"
#include "core/reading_apart.h"
#include "world/vdb/vdb_lengths.h"
#include "world/vdb/vdb_stream.h"

namespace terracast::world {
namespace {

using core::ErrorKind;
using core::fail;

/// Frames with z up.
Eigen::Vector3d upward(const openvdb::Vec3d& at, bool is_upward_y) {
  return is_upward_y ? Eigen::Vector3d(at.x(), -at.z(), at.y())
                     : Eigen::Vector3d(at.x(), at.y(), at.z());
}
openvdb::Vec3d from_upward(const Eigen::Vector3d& at, bool is_upward_y) {
  return is_upward_y ? openvdb::Vec3d(at.x(), at.z(), -at.y())
                     : openvdb::Vec3d(at.x(), at.y(), at.z());
}

/// Reads one grid of a file, and where its grids follow each other without offsets all of them, before it. OpenVDB's own
/// readers of files go on behind a file's end, through all that its counts state; this one's stream throws there.
class GridReader : private openvdb::io::Archive {
 public:
  explicit GridReader(const std::filesystem::path& file) : in_(file, std::ios::binary) {
    in_.exceptions(std::ios::failbit | std::ios::badbit);
    readHeader(in_);
    openvdb::io::setStreamMetadataPtr(in_, metadata_, /*transfer=*/false);
    setFormatVersion(in_);
    setLibraryVersion(in_);
    setDataCompression(in_);
    openvdb::MetaMap().readMeta(in_);
    for (auto left = readGridCount(in_); left > 0; --left) {
      Entry& one = entries_.emplace_back();
      one.grid = one.descriptor.read(in_);
      one.begins_at = in_.tellg();
      if (inputHasGridOffsets())
        one.descriptor.seekToEnd(in_);
      else
        readGrid(one.grid, one.descriptor, in_);
    }
  }

  /// Of grids that share a name: "density[1]".
  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const Entry& one : entries_)
      names.push_back(openvdb::io::GridDescriptor::nameAsString(one.descriptor.uniqueName()));
    return names;
  }

  openvdb::GridBase::Ptr read(std::size_t index) {
    const openvdb::io::GridDescriptor& wanted = entries_[index].descriptor;
    read_own(entries_[index]);
    if (wanted.isInstance()) {
      NamedGridMap family = {{wanted.uniqueName(), entries_[index].grid}};
      for (Entry& one : entries_)
        if (one.descriptor.uniqueName() == wanted.instanceParentName() &&
            family.emplace(one.descriptor.uniqueName(), one.grid).second)
          read_own(one);
      connectInstance(wanted, family);
    }
    return entries_[index].grid;
  }

 private:
  struct Entry {
    openvdb::io::GridDescriptor descriptor;
    openvdb::GridBase::Ptr grid;
    std::streampos begins_at;
  };

  void read_own(Entry& one) {
    if (!inputHasGridOffsets()) return;
    in_.seekg(one.begins_at);
    readGrid(one.grid, one.descriptor, in_);
  }

  /// The stream points to it.
  openvdb::io::StreamMetadata::Ptr metadata_ = std::make_shared<openvdb::io::StreamMetadata>();
  std::ifstream in_;
  std::vector<Entry> entries_;
};

openvdb::FloatGrid::Ptr read_grid(const std::filesystem::path& file, const std::string& wanted) {
  check_vdb_lengths(file);
  GridReader reader(file);
  const std::vector<std::string> names = reader.names();
  auto found = std::find(names.begin(), names.end(), wanted.empty() ? "density" : wanted);
  if (found == names.end() && wanted.empty() && names.size() == 1) found = names.begin();
  if (found == names.end())
    fail(ErrorKind::Input, "{}: holds the grids {}; name one of them{}", file.string(),
         names.empty() ? "(none)" : fmt::format("{}", fmt::join(names, ", ")),
         wanted.empty() ? "" : fmt::format(", \"{}\" is none", wanted));
  // The whole grid is read now: a file that is changed while it is used must not be followed.
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(
      reader.read(static_cast<std::size_t>(found - names.begin())));
  if (!grid)
    fail(ErrorKind::Input, "{}: its grid {} holds no single floats", file.string(), *found);
  return grid;
}

Volume sampled(const openvdb::FloatGrid& grid, const std::filesystem::path& file,
               const VdbOptions& options) {
  const openvdb::CoordBBox bounds = grid.evalActiveVoxelBoundingBox();
  if (bounds.empty())
    fail(ErrorKind::Input, "{}: its grid {} holds nothing", file.string(), grid.getName());
  Eigen::AlignedBox3d box_m;
  for (int corner = 0; corner < 8; ++corner) {
    const openvdb::Vec3d at((corner & 1) != 0 ? bounds.max().x() + 0.5 : bounds.min().x() - 0.5,
                            (corner & 2) != 0 ? bounds.max().y() + 0.5 : bounds.min().y() - 0.5,
                            (corner & 4) != 0 ? bounds.max().z() + 0.5 : bounds.min().z() - 0.5);
    box_m.extend(options.unit_m * upward(grid.indexToWorld(at), options.is_upward_y));
  }
  Volume volume;
  volume.name = grid.getName();
  const openvdb::Vec3d own = grid.voxelSize();
  volume.voxel_m = options.voxel_m > 0.0 ? options.voxel_m
                                         : options.unit_m * std::min({own.x(), own.y(), own.z()});
  if (!(volume.voxel_m > 0.0) || !std::isfinite(volume.voxel_m) || !box_m.sizes().allFinite())
    fail(ErrorKind::Input, "{}: its grid {} has voxels of {} m", file.string(), grid.getName(),
         volume.voxel_m);
  const Eigen::Array3d size = (box_m.sizes().array() / volume.voxel_m - 1e-6).ceil().max(1.0);
  if (size.maxCoeff() > kMaxVolumeSide)
    fail(ErrorKind::Input,
         "{}: its grid {} takes {} x {} x {} voxels of {} m; {} a side fit: state a larger voxel_m",
         file.string(), grid.getName(), size.x(), size.y(), size.z(), volume.voxel_m,
         kMaxVolumeSide);
  volume.size = size.cast<int>();
  check_volume(volume.name, volume.size);
  volume.lowest_m = box_m.min();
  std::vector<float> values(static_cast<std::size_t>(size.prod()));
  openvdb::FloatGrid::ConstAccessor accessor = grid.getConstAccessor();
  using Sampler =
      openvdb::tools::GridSampler<openvdb::FloatGrid::ConstAccessor, openvdb::tools::BoxSampler>;
  const Sampler sampler(accessor, grid.transform());
  float largest = 0.0f;
  for (int z = 0; z < volume.size.z(); ++z)
    for (int y = 0; y < volume.size.y(); ++y)
      for (int x = 0; x < volume.size.x(); ++x) {
        const Eigen::Vector3d at_m =
            volume.lowest_m + volume.voxel_m * (Eigen::Vector3d(x, y, z).array() + 0.5).matrix();
        const float value =
            sampler.wsSample(from_upward(at_m / options.unit_m, options.is_upward_y));
        if (!std::isfinite(value))
          fail(ErrorKind::Input, "{}: its grid {} holds values that are no numbers", file.string(),
               grid.getName());
        values[volume.index(x, y, z)] = value;
        largest = std::max(largest, value);
      }
  const double full = options.full > 0.0 ? options.full : static_cast<double>(largest);
  if (!(full > 0.0))
    fail(ErrorKind::Input, "{}: its grid {} is nowhere above 0", file.string(), grid.getName());
  volume.density.resize(values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    volume.density[i] = static_cast<std::uint8_t>(
        std::clamp(static_cast<double>(values[i]) / full, 0.0, 1.0) * 255.0 + 0.5);
  return volume;
}

Volume read_here(const std::filesystem::path& file, const VdbOptions& options) {
  initialise_vdb();
  try {
    return sampled(*read_grid(file, options.grid), file, options);
  } catch (const core::Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    fail(ErrorKind::Input, "{}: cannot be read as an OpenVDB file; is it damaged? ({})",
         file.string(), error.what());
  }
}

/// A name of a grid may have any bytes.
constexpr std::size_t kMostNameBytes = 1 << 16;

}  // namespace

std::vector<std::byte> read_vdb_request(const core::Json& request) {
  const Volume volume = read_here(core::path_of_request(request.at("file").string()),
                                  {.grid = request.at("grid").string(),
                                   .unit_m = request.at("unit_m").number(),
                                   .voxel_m = request.at("voxel_m").number(),
                                   .full = request.at("full").number(),
                                   .is_upward_y = request.at("is_upward_y").boolean()});
  const std::string name = volume.name.substr(0, kMostNameBytes - 1);
  const std::vector<std::byte> encoded = encode_volume(volume);
  std::vector<std::byte> answer(name.size() + 1);
  std::memcpy(answer.data(), name.c_str(), answer.size());
  answer.insert(answer.end(), encoded.begin(), encoded.end());
  return answer;
}

Volume read_vdb(const std::filesystem::path& file, const VdbOptions& options) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    fail(ErrorKind::Io, "{}: there is no such file; give the path of an OpenVDB file",
         file.string());
  const std::vector<std::byte> answer =
      core::read_apart("vdb",
                       core::Json::object()
                           .set("file", core::path_for_request(file))
                           .set("grid", options.grid)
                           .set("unit_m", options.unit_m)
                           .set("voxel_m", options.voxel_m)
                           .set("full", options.full)
                           .set("is_upward_y", options.is_upward_y),
                       file.string());
  const auto name_end = std::find(answer.begin(), answer.end(), std::byte{0});
  if (name_end == answer.end())
    fail(ErrorKind::Input, "{}: its reader's answer has no end of its name", file.string());
  const auto name_size = static_cast<std::size_t>(name_end - answer.begin());
  Volume volume = decode_volume(std::span(answer).subspan(name_size + 1), file.string());
  volume.name.assign(reinterpret_cast<const char*>(answer.data()), name_size);
  return volume;
}

std::vector<std::byte> encode_vdb(std::span<const VdbGrid> grids) {
  initialise_vdb();
  openvdb::GridCPtrVec all;
  for (const VdbGrid& one : grids) {
    const Volume& volume = *one.volume;
    auto grid = openvdb::FloatGrid::create(0.0f);
    grid->setName(one.name);
    grid->setGridClass(openvdb::GRID_FOG_VOLUME);
    for (const auto& [name, text] : one.notes)
      grid->insertMeta(name, openvdb::StringMetadata(text));
    auto accessor = grid->getAccessor();
    for (int z = 0; z < volume.size.z(); ++z)
      for (int y = 0; y < volume.size.y(); ++y)
        for (int x = 0; x < volume.size.x(); ++x)
          if (const std::uint8_t code = volume.density[volume.index(x, y, z)]; code != 0)
            accessor.setValue({x, y, z}, static_cast<float>(one.factor * code / 255.0));
    // Values stand at the voxels' centres.
    Eigen::Affine3d volume_from_index = Eigen::Affine3d::Identity();
    volume_from_index.linear() *= volume.voxel_m;
    volume_from_index.translation() =
        volume.lowest_m + Eigen::Vector3d::Constant(0.5 * volume.voxel_m);
    const Eigen::Matrix4d matrix = (one.file_from_volume * volume_from_index).matrix();
    openvdb::Mat4d transform;  // of rows
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) transform(j, i) = matrix(i, j);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(transform));
    all.push_back(grid);
  }
  return bytes_of_grids(all);
}

}  // namespace terracast::world
