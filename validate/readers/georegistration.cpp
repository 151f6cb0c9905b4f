#include "validate/readers/georegistration.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/printable.h"
#include "validate/text.h"

namespace terracast::validate {

std::vector<std::pair<std::string, GeoregistrationPlace>> read_georegistration_lines(
    const std::filesystem::path& file, const std::string& where) {
  const std::string text = core::read_text_file(file);
  std::vector<std::pair<std::string, GeoregistrationPlace>> places;
  for (const TextLine& line : split_lines(text)) {
    const std::string at = fmt::format("{}:{}", where, line.number);
    // A name may have blanks in it.
    const std::vector<std::string_view> words = split_blanks(line.text);
    constexpr std::size_t kNumbers = 3;
    if (words.size() <= kNumbers)
      core::fail(core::ErrorKind::Input, "{}: not an image's name and three numbers", at);
    const auto* end_of_name =
        words[words.size() - kNumbers - 1].data() + words[words.size() - kNumbers - 1].size();
    std::string name(words[0].data(), end_of_name);
    GeoregistrationPlace place{};
    for (std::size_t k = 0; k < kNumbers; ++k)
      place[k] = parse_number(words[words.size() - kNumbers + k], at);
    places.emplace_back(std::move(name), place);
  }
  return places;
}

GeoregistrationPlaces read_georegistration(const std::filesystem::path& file,
                                           const std::string& where) {
  GeoregistrationPlaces places;
  for (const auto& [name, place] : read_georegistration_lines(file, where))
    if (!places.emplace(name, place).second)
      core::fail(core::ErrorKind::Input, "{}: \"{}\" stands twice", where,
                 core::first_letters(name, 100));
  return places;
}

}  // namespace terracast::validate
