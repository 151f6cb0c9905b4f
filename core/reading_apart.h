#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/confinement.h"
#include "core/json.h"
#include "core/unnamed_file.h"

/// Reads files from outside in a process of its own: what a library does there with a file that is damaged, or made to do
/// harm, ends with that process, and is an ordinary error here.
namespace terracast::core {

/// A kind of reading that the program does in a process of its own.
struct ApartReader {
  std::string_view kind;  ///< "vdb"
  /// Reads what a request asks for; whatever it throws is thrown by read_apart() in the process that asked.
  std::vector<std::byte> (*read)(const Json& request);
};

struct ApartOptions {
  ReadingLimits limits = {};  ///< of a file no byte where none is given
  std::uint64_t most_result_bytes = std::uint64_t{4} << 30;
  double longest_s = 3600.0;  ///< by the clock, which waiting counts on too
  /// Takes what the reader writes by append_to_file(), up to limits.file_bytes; empty before. null: nothing.
  const UnnamedFile* file = nullptr;
};

/// A path for a request: it may have bytes that are no text.
std::string path_for_request(const std::filesystem::path& path);
std::filesystem::path path_of_request(const std::string& text);

/// Has a reader of the program beside this one (`terracast_program`) read a file, confined (confine_this_process()).
/// file     for messages
/// request  what the reader is told; at most 100 kB
/// returns  the reader's result, which is of a file from outside still
/// throws   what the reader throws; Input: it was ended by a signal, took more memory or time than it may, or returned more
///          than it may; Io: the system killed it, which it does for want of memory; Interrupted: a stop was asked for, within
///          0.2 s; Internal: the program cannot be started
/// cost     0.1 s for the process, whose libraries are loaded
/// threads  safe; as RunningProgram
std::vector<std::byte> read_apart(std::string_view kind, const Json& request,
                                  const std::string& file, const ApartOptions& options = {});

/// For readers, in the process of read_apart(): adds to the end of the file that ApartOptions gave.
/// of       the file that is read, for messages
/// throws   Input: the file would grow beyond its limit; Io: it cannot be written, which a full disk is the cause of
void append_to_file(std::span<const std::byte> bytes, const std::string& of);

/// Whether a command line is one of read_apart().
bool is_reading_apart(int argc, char** argv);
/// The whole of a process that read_apart() has started: reads, answers, ends.
/// returns  its exit status
int serve_reading(std::span<const ApartReader> readers, int argc, char** argv);

}  // namespace terracast::core
