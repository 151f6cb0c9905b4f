#include "export/events/hdf5_file.h"

#include <mutex>

#include "core/error.h"

namespace terracast::exporters {
namespace {

using core::ErrorKind;
using core::fail;

constexpr unsigned kDeflateLevel = 4;

std::mutex& library_mutex() {
  static std::mutex mutex;
  return mutex;
}

hid_t new_file(const std::filesystem::path& path) {
  // Messages of the library's own would stand between ours.
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  return H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
}

}  // namespace

Hdf5Lock::Hdf5Lock() { library_mutex().lock(); }
Hdf5Lock::~Hdf5Lock() { library_mutex().unlock(); }

Hdf5File::Hdf5File(const std::filesystem::path& path)
    : path_(path.string()), file_(new_file(path), H5Fclose) {
  checked(file_.id());
}

hid_t Hdf5File::checked(hid_t id) const {
  if (id < 0)
    fail(ErrorKind::Io, "{}: cannot be written as HDF5; is the disk full, or the folder gone?",
         path_);
  return id;
}

void Hdf5File::make_group(const std::string& name) {
  const Hdf5Handle properties(checked(H5Pcreate(H5P_GROUP_CREATE)), H5Pclose);
  checked(H5Pset_obj_track_times(properties.id(), false));
  const Hdf5Handle group(
      checked(H5Gcreate2(file_.id(), name.c_str(), H5P_DEFAULT, properties.id(), H5P_DEFAULT)),
      H5Gclose);
}

void Hdf5File::make_list(const std::string& name, hid_t type, std::size_t chunk) {
  const hsize_t none = 0, endless = H5S_UNLIMITED, chunk_size = chunk;
  const Hdf5Handle space(checked(H5Screate_simple(1, &none, &endless)), H5Sclose);
  const Hdf5Handle properties(checked(H5Pcreate(H5P_DATASET_CREATE)), H5Pclose);
  checked(H5Pset_obj_track_times(properties.id(), false));
  checked(H5Pset_chunk(properties.id(), 1, &chunk_size));
  checked(H5Pset_shuffle(properties.id()));
  checked(H5Pset_deflate(properties.id(), kDeflateLevel));
  const Hdf5Handle list(checked(H5Dcreate2(file_.id(), name.c_str(), type, space.id(), H5P_DEFAULT,
                                           properties.id(), H5P_DEFAULT)),
                        H5Dclose);
}

void Hdf5File::append(const std::string& name, hid_t type, const void* numbers, std::size_t count) {
  if (count == 0) return;
  Hdf5Handle list(checked(H5Dopen2(file_.id(), name.c_str(), H5P_DEFAULT)), H5Dclose);
  hsize_t start = 0;
  {
    const Hdf5Handle old(checked(H5Dget_space(list.id())), H5Sclose);
    checked(H5Sget_simple_extent_dims(old.id(), &start, nullptr));
  }
  const hsize_t more = count, size = start + more;
  checked(H5Dset_extent(list.id(), &size));
  const Hdf5Handle space(checked(H5Dget_space(list.id())), H5Sclose);
  checked(H5Sselect_hyperslab(space.id(), H5S_SELECT_SET, &start, nullptr, &more, nullptr));
  const Hdf5Handle memory(checked(H5Screate_simple(1, &more, nullptr)), H5Sclose);
  checked(H5Dwrite(list.id(), type, memory.id(), space.id(), H5P_DEFAULT, numbers));
  // What is deflated is written when the list is closed.
  if (!list.close()) checked(-1);
}

void Hdf5File::write_scalar(const std::string& name, hid_t type, hid_t native, const void* number) {
  const Hdf5Handle space(checked(H5Screate(H5S_SCALAR)), H5Sclose);
  const Hdf5Handle properties(checked(H5Pcreate(H5P_DATASET_CREATE)), H5Pclose);
  checked(H5Pset_obj_track_times(properties.id(), false));
  const Hdf5Handle scalar(checked(H5Dcreate2(file_.id(), name.c_str(), type, space.id(),
                                             H5P_DEFAULT, properties.id(), H5P_DEFAULT)),
                          H5Dclose);
  checked(H5Dwrite(scalar.id(), native, H5S_ALL, H5S_ALL, H5P_DEFAULT, number));
}

void Hdf5File::write_array(const std::string& name, hid_t type, hid_t native,
                           std::span<const hsize_t> sizes, const void* numbers) {
  const Hdf5Handle space(
      checked(H5Screate_simple(static_cast<int>(sizes.size()), sizes.data(), nullptr)), H5Sclose);
  const Hdf5Handle properties(checked(H5Pcreate(H5P_DATASET_CREATE)), H5Pclose);
  checked(H5Pset_obj_track_times(properties.id(), false));
  checked(H5Pset_chunk(properties.id(), static_cast<int>(sizes.size()), sizes.data()));
  checked(H5Pset_shuffle(properties.id()));
  checked(H5Pset_deflate(properties.id(), kDeflateLevel));
  Hdf5Handle array(checked(H5Dcreate2(file_.id(), name.c_str(), type, space.id(), H5P_DEFAULT,
                                      properties.id(), H5P_DEFAULT)),
                   H5Dclose);
  checked(H5Dwrite(array.id(), native, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers));
  if (!array.close()) checked(-1);
}

void Hdf5File::close() {
  if (!file_.close()) checked(-1);
}

}  // namespace terracast::exporters
