#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

/// The readers of foreign files, fed with inputs that no writer made.
namespace terracast::fuzz {

using Bytes = std::span<const std::byte>;

/// A reader, wrapped so that any bytes are an input of it.
struct Target {
  std::string_view name;
  /// Ends by core::Error where the bytes are wrong. Files are written to a folder of the process's own
  /// (tests/fuzz/scratch.h). The same bytes have the same end.
  void (*read)(Bytes input);
};

/// The table of readers, in alphabetical order.
std::span<const Target> targets();

/// nullptr: there is none of that name.
const Target* find_target(std::string_view name);

/// Makes this process one that reads everything itself, also what terracast reads in a process of its own, and GDAL quiet
/// about it. Once, before the first input.
void prepare();

/// Reads an input. An error of the kinds that a wrong file may have (Input, Io, and Config of what users write) is an
/// ordinary end, and so is a lack of memory that was told by std::bad_alloc.
/// returns  why the reader refused it; empty: it took it for right
/// throws   whatever else the reader throws, as a std::runtime_error that says what it was: it is a find
std::string run(const Target& target, Bytes input);

}  // namespace terracast::fuzz
