#include "geo/fixes/srt_fields.h"

#include <algorithm>
#include <array>

#include "geo/fixes/text.h"
#include "geo/fixes/times.h"

namespace terracast::geo {
namespace {

constexpr std::string_view kOfTheCamera = "the camera's settings, which the config states";
constexpr std::string_view kOfTheFile = "counts the pictures";
constexpr std::string_view kOfDistance = "follows from the places";

// By the subtitles of DJI's Mavic, Mini, Air, Phantom, Matrice and Zenmuse, and Autel's EVO.
constexpr std::array kKnown = {
    core::KnownName{kSrtDate, "time"},
    core::KnownName{"latitude", "latitude"},
    core::KnownName{"longitude", "longitude"},
    core::KnownName{"longtitude", "longitude"},
    core::KnownName{"gps", "latitude and longitude, in the order of order or by their letters"},
    core::KnownName{"rtk", "latitude and longitude, in the order of order or by their letters"},
    core::KnownName{"gps[3] m", "height, where letters say what is latitude and what longitude"},
    core::KnownName{"home", "the place of take-off"},
    core::KnownName{"rel_alt", "height above take-off"},
    core::KnownName{"h", "height above take-off"},
    core::KnownName{"barometer", "height above take-off"},
    core::KnownName{"hb", "height above take-off"},
    core::KnownName{"reh", "height above take-off"},
    core::KnownName{"abs_alt", "height of its own"},
    core::KnownName{"altitude", "height of its own"},
    core::KnownName{"absolute_altitude", "height of its own"},
    core::KnownName{"f.pry", "the body's pitch, roll and yaw"},
    core::KnownName{"g.pry", "the camera's pitch, roll and yaw"},
    core::KnownName{"gb_yaw", "the camera's yaw"},
    core::KnownName{"gb_pitch", "the camera's pitch"},
    core::KnownName{"gb_roll", "the camera's roll"},
    core::KnownName{"h.s", "speed over ground, which the motion is compared with"},

    core::KnownName{"gps[3]", "satellites in view, or a height that says not what it is above",
                    false},
    core::KnownName{"rtk[3]", "satellites in view, or a height that says not what it is above",
                    false},
    core::KnownName{"home[3]", "says not what it is above; home_height_m does", false},
    core::KnownName{"d", kOfDistance, false},
    core::KnownName{"v.s", kOfDistance, false},
    core::KnownName{"distance", kOfDistance, false},
    core::KnownName{"hs", "height above what is below, by sound, which fails high up", false},
    core::KnownName{"srtcnt", kOfTheFile, false},
    core::KnownName{"framecnt", kOfTheFile, false},
    core::KnownName{"no", kOfTheFile, false},
    core::KnownName{"difftime", "follows from the times", false},
};

constexpr std::string_view kCamera[] = {"f",
                                        "ss",
                                        "iso",
                                        "ev",
                                        "dzoom",
                                        "shutter",
                                        "fnum",
                                        "f-num",
                                        "ct",
                                        "color_md",
                                        "focal_len",
                                        "dzoom_ratio",
                                        "delta",
                                        "ae_meter_md",
                                        "pp_exposure_mode",
                                        "tv",
                                        "ir",
                                        "m.m",
                                        "a.t",
                                        "luma",
                                        "coef",
                                        "facedetecttag",
                                        "facedetectrect",
                                        "gain",
                                        "index",
                                        "e.m",
                                        "aerect",
                                        "aeadvscene",
                                        "lecurve",
                                        "afspd",
                                        "af",
                                        "rect",
                                        "afpos",
                                        "awbmode",
                                        "awb",
                                        "colortemp",
                                        "b.l",
                                        "iqs",
                                        "toneinfo",
                                        "isp",
                                        "info",
                                        "wb",
                                        "awb_gain",
                                        "fov",
                                        "zoom",
                                        "digital_zoom",
                                        "dzoom_rate",
                                        "hyperlapse",
                                        "aperture",
                                        "exposure",
                                        "color",
                                        "style",
                                        "sharpness",
                                        "contrast",
                                        "saturation"};

std::vector<core::KnownName> all_known() {
  std::vector<core::KnownName> known(kKnown.begin(), kKnown.end());
  for (const std::string_view name : kCamera) known.push_back({name, kOfTheCamera, false});
  return known;
}

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_of_name(char c) { return is_letter(c) || is_digit(c) || c == '_' || c == '.' || c == '-'; }
bool ends_field(char c) {
  return c == ',' || c == ';' || c == '[' || c == ']' || c == '|' || c == '\n';
}
bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/// Takes fields off the front of a text.
class FieldScanner {
 public:
  explicit FieldScanner(std::string_view text) : text_(text) {}

  std::vector<SrtField> all() {
    std::vector<SrtField> fields;
    while (at_ < text_.size()) {
      if (is_blank(text_[at_]) || ends_field(text_[at_]))
        ++at_;
      else if (is_digit(text_[at_]) && take_date(fields))
        continue;
      else if (is_letter(text_[at_]))
        fields.push_back(next_field());
      else if (text_[at_] == '(' && !fields.empty() && fields.back().name != kSrtDate)
        fields.back().value += " (" + in_brackets() + ")";  // of "LeCurve(64) (1024,1024)"
      else
        fields.push_back({std::string(word_without_blanks()), ""});
    }
    return fields;
  }

 private:
  char now() const { return at_ < text_.size() ? text_[at_] : '\n'; }
  void skip_blanks() {
    while (at_ < text_.size() && is_blank(text_[at_])) ++at_;
  }

  /// The longest text from here that is a date and time of day, up to the line's end.
  bool take_date(std::vector<SrtField>& fields) {
    constexpr std::string_view kLetters = "0123456789-./:, TZ+";
    constexpr std::size_t kLongest = 40;
    const std::size_t most = std::min(at_ + kLongest, text_.size());
    std::size_t end = at_;
    while (end < most && kLetters.find(text_[end]) != std::string_view::npos) ++end;
    constexpr std::size_t kShortest = 14;  // 2019.9.8 1:02:03
    for (; end >= at_ + kShortest; --end) {
      const std::string_view text = trimmed(text_.substr(at_, end - at_));
      const bool is_whole = !text.empty() && (is_digit(text.back()) || text.back() == 'Z');
      if (!is_whole || !stated_time(text, 0.0)) continue;
      fields.push_back({kSrtDate, std::string(text)});
      at_ = end;
      return true;
    }
    return false;
  }

  std::string_view word_without_blanks() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && !is_blank(text_[at_]) && !ends_field(text_[at_])) ++at_;
    if (at_ == begin) ++at_;
    return text_.substr(begin, at_ - begin);
  }

  SrtField next_field() {
    const std::size_t begin = at_;
    while (is_of_name(now())) ++at_;
    SrtField field{in_lower_case(text_.substr(begin, at_ - begin)), ""};
    if (now() == '/') {
      ++at_;
      field.value = word_without_blanks();
      return field;
    }
    const std::size_t behind_name = at_;
    skip_blanks();
    if (now() == '(') {
      field.value = in_brackets();
    } else if (now() == ':') {
      ++at_;
      field.value = value_behind_colon();
    } else if (!ends_field(now()) && !is_letter(now())) {
      field.value = word_without_blanks();
    } else {
      at_ = behind_name;
      take_word_of(field);
    }
    return field;
  }

  /// "M.M AE_METER_CENTER,": a word is the value where the field ends behind it.
  void take_word_of(SrtField& field) {
    const std::size_t before = at_;
    skip_blanks();
    if (!is_letter(now())) return;
    const std::string_view word = word_without_blanks();
    const bool is_value =
        word.find_first_of(":(") == std::string_view::npos && ends_field(now()) && now() != '\n';
    if (is_value)
      field.value = word;
    else
      at_ = before;
  }

  /// Up to the bracket that closes the one that stands here.
  std::string in_brackets() {
    const std::size_t begin = at_ + 1;
    int depth = 0;
    for (; at_ < text_.size(); ++at_) {
      if (text_[at_] == '(') ++depth;
      if (text_[at_] == ')' && --depth == 0) return std::string(text_.substr(begin, at_++ - begin));
    }
    return std::string(text_.substr(begin));
  }

  /// Nothing where the next field's name follows: "EV: Fnum:2.2".
  std::string value_behind_colon() {
    skip_blanks();
    const std::size_t begin = at_;
    const auto is_digit_at = [&](std::size_t at) {
      return at < text_.size() && text_[at] >= '0' && text_[at] <= '9';
    };
    // A comma between digits is a decimal one, which is not understood, but no end.
    const auto is_inner_comma = [&] {
      return text_[at_] == ',' && at_ > begin && is_digit_at(at_ - 1) && is_digit_at(at_ + 1) &&
             text_.substr(begin, at_ - begin).find_first_of(".,") == std::string_view::npos;
    };
    while (at_ < text_.size() && !is_blank(text_[at_]) &&
           (!ends_field(text_[at_]) || is_inner_comma())) {
      if (text_[at_] == ':' && is_letter(text_[begin])) {
        at_ = begin;
        return "";
      }
      ++at_;
    }
    return std::string(text_.substr(begin, at_ - begin));
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

std::span<const core::KnownName> known_srt_fields() {
  static const std::vector<core::KnownName> known = all_known();
  return known;
}

std::string srt_text(std::string_view lines) {
  std::string text;
  text.reserve(lines.size());
  // Behind these nothing closes any more.
  const std::size_t last_angle = lines.rfind('>'), last_brace = lines.rfind('}');
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const char c = lines[i];
    const bool is_tag = c == '<' || (c == '{' && i + 1 < lines.size() && lines[i + 1] == '\\');
    const std::size_t last = c == '<' ? last_angle : last_brace;
    if (is_tag && last != std::string_view::npos && last > i) {
      i = lines.find(c == '<' ? '>' : '}', i);
      continue;
    }
    if (c == '\\' && i + 1 < lines.size() && (lines[i + 1] == 'N' || lines[i + 1] == 'n')) {
      text += '\n';
      ++i;
      continue;
    }
    text += c;
  }
  return text;
}

std::vector<SrtField> srt_fields(std::string_view text) { return FieldScanner(text).all(); }

std::optional<double> leading_number(std::string_view text) {
  const std::string_view digits = trimmed(text);
  const std::size_t end = std::min(digits.find_first_not_of("+-.0123456789"), digits.size());
  // A decimal comma: the number goes on behind it.
  const bool goes_on = end + 1 < digits.size() && digits[end] == ',' && digits[end + 1] >= '0' &&
                       digits[end + 1] <= '9';
  return goes_on ? std::nullopt : number_of(digits.substr(0, end));
}

}  // namespace terracast::geo
