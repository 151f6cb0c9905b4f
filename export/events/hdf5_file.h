#pragma once

#include <hdf5.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace terracast::exporters {

/// A handle of HDF5, closed at its end.
class Hdf5Handle {
 public:
  Hdf5Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Hdf5Handle() { close(); }
  Hdf5Handle(const Hdf5Handle&) = delete;
  Hdf5Handle& operator=(const Hdf5Handle&) = delete;
  hid_t id() const { return id_; }
  /// returns   whether it could be closed; then, or if it was closed already, there is nothing more to do
  bool close() {
    const hid_t id = id_;
    id_ = -1;
    return id < 0 || close_(id) >= 0;
  }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// A file of HDF5 that is written. Its bytes follow from what is written alone. The library serves one thread at a time:
/// hold an Hdf5Lock for as long as there is a file.
/// throws   Io, from all of its functions
class Hdf5File {
 public:
  explicit Hdf5File(const std::filesystem::path& path);

  void make_group(const std::string& name);
  /// A list that grows, deflated and shuffled.
  void make_list(const std::string& name, hid_t type, std::size_t chunk);
  /// Appends numbers of the native type.
  void append(const std::string& name, hid_t type, const void* numbers, std::size_t count);
  void write_scalar(const std::string& name, hid_t type, hid_t native, const void* number);
  void write_array(const std::string& name, hid_t type, hid_t native,
                   std::span<const hsize_t> sizes, const void* numbers);
  /// Writes all that is outstanding.
  void close();

 private:
  hid_t checked(hid_t id) const;

  std::string path_;
  Hdf5Handle file_;
};

/// Locks the library for this thread.
class Hdf5Lock {
 public:
  Hdf5Lock();
  ~Hdf5Lock();
  Hdf5Lock(const Hdf5Lock&) = delete;
  Hdf5Lock& operator=(const Hdf5Lock&) = delete;
};

}  // namespace terracast::exporters
