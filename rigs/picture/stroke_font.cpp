#include "rigs/picture/stroke_font.h"

#include <algorithm>
#include <map>

namespace terracast::rigs {
namespace {

/// Strokes of each letter, between blanks, as pairs of digits x y: x from 0 to 4, y from 0 up, with the base line at 2,
/// the top of small letters at 6, of capitals at 8.
const std::map<std::string_view, std::string_view>& glyphs() {
  static const std::map<std::string_view, std::string_view> table{
      {"0", "120307183847433212"},
      {"1", "172822 1232"},
      {"2", "07183847460242"},
      {"3", "07183847463544433212 1203 1535"},
      {"4", "32380444"},
      {"5", "480805354443321203"},
      {"6", "473818070312324344351504"},
      {"7", "084812"},
      {"8", "15060718384746351504031232434435"},
      {"9", "031232434738180706153546"},
      {"A", "022842 1434"},
      {"B", "02083847463505 3544433202"},
      {"C", "4738180703123243"},
      {"D", "02082846442202"},
      {"E", "48080242 0535"},
      {"F", "480802 0535"},
      {"G", "47381807031232434525"},
      {"H", "0208 4248 0545"},
      {"I", "1232 1838 2228"},
      {"J", "4843321203"},
      {"K", "0208 4804 1542"},
      {"L", "080242"},
      {"M", "0208254842"},
      {"N", "02084248"},
      {"O", "120307183847433212"},
      {"P", "02083847463505"},
      {"Q", "120307183847433212 2442"},
      {"R", "02083847463505 2542"},
      {"S", "473818070615354443321203"},
      {"T", "0848 2822"},
      {"U", "080312324348"},
      {"V", "082248"},
      {"W", "0812253248"},
      {"X", "0248 0842"},
      {"Y", "082548 2522"},
      {"Z", "08480242"},
      {"a", "4642 4536160503123243"},
      {"b", "0802 0516364543321203"},
      {"c", "4536160503123243"},
      {"d", "4842 4536160503123243"},
      {"e", "04444536160503123243"},
      {"f", "38281712 0636"},
      {"g", "4641301001 4536160503123243"},
      {"h", "0802 0516364542"},
      {"i", "0602 0808"},
      {"j", "161100 1818"},
      {"k", "0802 3603 1432"},
      {"l", "0802"},
      {"m", "0602 05162522 25364542"},
      {"n", "0602 0516364542"},
      {"o", "120305163645433212"},
      {"p", "0600 0516364543321203"},
      {"q", "4640 4536160503123243"},
      {"r", "0602 051636"},
      {"s", "45361605143443321203"},
      {"t", "18132232 0636"},
      {"u", "0603123243 4642"},
      {"v", "062246"},
      {"w", "0612253246"},
      {"x", "0246 0642"},
      {"y", "0622 461000"},
      {"z", "06460242"},
      {".", "0202"},
      {",", "1201"},
      {":", "0303 0606"},
      {"-", "0535"},
      {"+", "0444 2226"},
      {"/", "0248"},
      {"(", "18060412"},
      {")", "08161402"},
      {"=", "0343 0545"},
      {"_", "0141"},
      {"%", "0248 0607181706 3233434232"},
      {"\xc2\xb0", "0718271607"},
      {"\xc3\x97", "0337 0733"},
  };
  return table;
}

constexpr double kUnitsOfSize = 8.0;  // capitals of 6 are 3/4 of a font's size
constexpr double kBaseLine = 2.0;
constexpr double kBlank = 2.0;
constexpr double kBetween = 1.6;

}  // namespace

StrokedText stroked_text(std::string_view text, double size) {
  const double scale = size / kUnitsOfSize;
  StrokedText result;
  double x = 0.0;
  for (std::size_t at = 0; at < text.size();) {
    const bool is_pair = static_cast<unsigned char>(text[at]) >= 0x80 && at + 1 < text.size();
    const std::string_view letter = text.substr(at, is_pair ? 2 : 1);
    at += letter.size();
    const auto glyph = glyphs().find(letter);
    double width = 0.0;
    if (glyph == glyphs().end()) {
      width = kBlank;
    } else {
      Shape::Outline stroke;
      const std::string_view digits = glyph->second;
      for (std::size_t i = 0; i < digits.size(); i += digits[i] == ' ' ? 1 : 2) {
        if (digits[i] == ' ') {
          result.strokes.push_back(std::move(stroke));
          stroke.clear();
          continue;
        }
        width = std::max(width, static_cast<double>(digits[i] - '0'));
        stroke.emplace_back(scale * (x + (digits[i] - '0')),
                            scale * (kBaseLine - (digits[i + 1] - '0')));
      }
      result.strokes.push_back(std::move(stroke));
    }
    x += width + kBetween;
  }
  result.width = scale * std::max(0.0, x - kBetween);
  return result;
}

}  // namespace terracast::rigs
