#include <algorithm>
#include <sstream>

#include "coupler/base/case_state.hpp"

namespace ocublast::case_text {
namespace {

/// Number of single-letter edits between two words (Levenshtein 1966).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0U : 1U)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

}  // namespace

/// The known word nearest to `word`, also one that differs only in its unit suffix; else empty.
std::string nearest_word(std::string_view word, const std::set<std::string>& known) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(3, word.size() / 2);
  const auto stem = [](std::string_view w) { return w.substr(0, w.find('_')); };
  for (const auto& candidate : known) {
    std::size_t distance = edit_distance(word, candidate);
    if (stem(word) == stem(candidate)) distance = std::min<std::size_t>(distance, 2);
    if (distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

std::string number_text(double value) {
  return fmt::format("{:.10g}", value);
}

std::string range_text(const RealKey& key) {
  const bool bounded_below = std::isfinite(key.min);
  const bool bounded_above = std::isfinite(key.max);
  if (!bounded_below && !bounded_above) return "any number";
  if (!bounded_above) return fmt::format("{} {}", key.above_min ? ">" : ">=", number_text(key.min));
  if (!bounded_below) return fmt::format("{} {}", key.below_max ? "<" : "<=", number_text(key.max));
  return fmt::format("{}{}, {}{}", key.above_min ? '(' : '[', number_text(key.min),
                     number_text(key.max), key.below_max ? ')' : ']');
}

bool in_range(double value, const RealKey& key) {
  if (!std::isfinite(value)) return false;
  if (value < key.min || (key.above_min && value == key.min)) return false;
  return value <= key.max && !(key.below_max && value == key.max);
}

std::string with_unit(std::string_view number, std::string_view unit) {
  return unit.empty() || unit == "1" ? std::string(number) : fmt::format("{} {}", number, unit);
}

std::string value_text(const toml::node& node) {
  std::ostringstream out;
  node.visit([&](const auto& value) { out << value; });
  std::string text = out.str();
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return text;
}

std::string join(std::string_view path, std::string_view name) {
  if (path.empty()) return std::string(name);
  if (name.empty()) return std::string(path);
  return fmt::format("{}.{}", path, name);
}

std::uint64_t fnv1a(std::string_view text) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
  return hash;
}

}  // namespace ocublast::case_text
