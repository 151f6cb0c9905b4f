#include "validate/readers/georegistration.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/printable.h"
#include "validate/text.h"

namespace terracast::validate {

GeoregistrationPlaces read_georegistration(const std::filesystem::path& file,
                                           const std::string& where) {
  const std::string text = core::read_text_file(file);
  GeoregistrationPlaces places;
  for (const TextLine& line : split_lines(text)) {
    const std::string at = fmt::format("{}:{}", where, line.number);
    // A name may have blanks in it.
    const std::vector<std::string_view> words = split_blanks(line.text);
    constexpr std::size_t kNumbers = 3;
    if (words.size() <= kNumbers)
      core::fail(core::ErrorKind::Input, "{}: not an image's name and three numbers", at);
    const auto* end_of_name =
        words[words.size() - kNumbers - 1].data() + words[words.size() - kNumbers - 1].size();
    const std::string name(words[0].data(), end_of_name);
    std::array<double, kNumbers> place{};
    for (std::size_t k = 0; k < kNumbers; ++k)
      place[k] = parse_number(words[words.size() - kNumbers + k], at);
    if (!places.emplace(name, place).second)
      core::fail(core::ErrorKind::Input, "{}: \"{}\" stands twice", at,
                 core::first_letters(name, 100));
  }
  return places;
}

}  // namespace terracast::validate
