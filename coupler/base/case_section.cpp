#include <algorithm>
#include <cmath>

#include "coupler/base/case_reader.hpp"
#include "coupler/base/case_state.hpp"

namespace ocublast {

using namespace case_text;

namespace {

template <class T>
void keep(toml::table* effective, std::string_view name, const T& value) {
  if (effective != nullptr) effective->insert_or_assign(name, value);
}

}  // namespace

bool Section::listing() const {
  return reader_->state_->listing;
}
bool Section::present() const {
  return listing() || nodes_->table != nullptr;
}
bool Section::has(std::string_view name) const {
  return listing() || (nodes_->table != nullptr && nodes_->table->contains(name));
}

void Section::fault(std::string_view name, std::string_view text) {
  const toml::node* node = nodes_->table;
  if (node != nullptr && !name.empty() && nodes_->table->contains(name))
    node = nodes_->table->get(name);
  const std::string full = join(path_, name);
  reader_->state_->faults.push_back(
      fmt::format("{}: {}", reader_->state_->place(full, node), text));
}

namespace {

/// Says in a listing what a key is.
std::string describe(std::string_view path, std::string_view type, std::string_view unit,
                     std::string_view accepted, bool required, std::string_view fallback,
                     std::string_view help) {
  return fmt::format("{}  {}{}{}  accepted {}  {}  {}", path, type, unit.empty() ? "" : " in ",
                     unit, accepted, required ? "required" : fmt::format("default {}", fallback),
                     help);
}

}  // namespace

#define OCU_LOOK_UP_OR_RETURN(type_name, unit, accepted, default_text)                          \
  auto& state = *reader_->state_;                                                               \
  state.known[path_].insert(std::string(name));                                                 \
  if (state.listing) {                                                                          \
    state.keys.push_back(describe(join(path_, name), type_name, unit, accepted, key.required,   \
                                  default_text, key.help));                                     \
    return;                                                                                     \
  }                                                                                             \
  const toml::node* node = nodes_->table != nullptr ? nodes_->table->get(name) : nullptr;       \
  if (node == nullptr) {                                                                        \
    if (key.required) fault(name, fmt::format("missing, accepted {}: {}", accepted, key.help)); \
  }

void Section::real(std::string_view name, double& value, const RealKey& key) {
  const std::string accepted = with_unit(range_text(key), key.unit);
  OCU_LOOK_UP_OR_RETURN("number", key.unit, accepted, number_text(value))
  if (node != nullptr) {
    if (!node->is_number()) {
      fault(name, fmt::format("is {}, expected a number in {}", value_text(*node), key.unit));
      return;
    }
    const double found = *node->value<double>();
    if (!in_range(found, key)) {
      fault(name,
            fmt::format("{} is {}, accepted {}{}{}", name, with_unit(number_text(found), key.unit),
                        accepted, key.advice.empty() ? "" : "; ", key.advice));
      return;
    }
    value = found;
  }
  keep(nodes_->effective, name, value);
}

void Section::reals(std::string_view name, std::vector<double>& values, const RealKey& key) {
  const std::string accepted = "a list of numbers " + with_unit(range_text(key), key.unit);
  OCU_LOOK_UP_OR_RETURN("numbers", key.unit, accepted, fmt::format("{} values", values.size()))
  if (node != nullptr) {
    const auto* array = node->as_array();
    if (array == nullptr) {
      fault(name, fmt::format("is {}, expected {}", value_text(*node), accepted));
      return;
    }
    std::vector<double> found;
    for (const auto& entry : *array) {
      if (!entry.is_number() || !in_range(*entry.value<double>(), key)) {
        fault(name, fmt::format("holds {}, accepted {}", value_text(entry), accepted));
        return;
      }
      found.push_back(*entry.value<double>());
    }
    values = std::move(found);
  }
  toml::array kept;
  for (const double v : values) kept.push_back(v);
  keep(nodes_->effective, name, kept);
}

void Section::real3(std::string_view name, std::array<double, 3>& value, const RealKey& key) {
  std::vector<double> values(value.begin(), value.end());
  const std::size_t before = reader_->state_->faults.size();
  reals(name, values, key);
  if (listing() || reader_->state_->faults.size() != before) return;
  if (values.size() != 3) {
    fault(name, fmt::format("has {} numbers, expected 3 (x, y, z in {})", values.size(), key.unit));
    return;
  }
  std::copy(values.begin(), values.end(), value.begin());
}

void Section::integer(std::string_view name, std::int64_t& value, const IntegerKey& key) {
  const std::string accepted =
      range_text({.min = key.min == std::numeric_limits<std::int64_t>::min()
                             ? -std::numeric_limits<double>::infinity()
                             : static_cast<double>(key.min),
                  .max = key.max == std::numeric_limits<std::int64_t>::max()
                             ? std::numeric_limits<double>::infinity()
                             : static_cast<double>(key.max)});
  OCU_LOOK_UP_OR_RETURN("integer", "", accepted, std::to_string(value))
  if (node != nullptr) {
    const auto found = node->value_exact<std::int64_t>();
    if (!found) {
      fault(name, fmt::format("is {}, expected a whole number", value_text(*node)));
      return;
    }
    if (*found < key.min || *found > key.max) {
      fault(name, fmt::format("{} is {}, accepted {}", name, *found, accepted));
      return;
    }
    value = *found;
  }
  keep(nodes_->effective, name, value);
}

void Section::integer(std::string_view name, int& value, const IntegerKey& key) {
  std::int64_t wide = value;
  IntegerKey narrow = key;
  narrow.min = std::max<std::int64_t>(key.min, std::numeric_limits<int>::min());
  narrow.max = std::min<std::int64_t>(key.max, std::numeric_limits<int>::max());
  integer(name, wide, narrow);
  value = static_cast<int>(wide);
}

void Section::flag(std::string_view name, bool& value, std::string_view help) {
  const TextKey key{.help = help};
  OCU_LOOK_UP_OR_RETURN("flag", "", "true, false", value ? "true" : "false")
  if (node != nullptr) {
    if (!node->is_boolean()) {
      fault(name, fmt::format("is {}, accepted true, false", value_text(*node)));
      return;
    }
    value = *node->value<bool>();
  }
  keep(nodes_->effective, name, value);
}

void Section::text(std::string_view name, std::string& value, const TextKey& key) {
  OCU_LOOK_UP_OR_RETURN("text", "", "text", fmt::format("'{}'", value))
  if (node != nullptr) {
    if (!node->is_string()) {
      fault(name, fmt::format("is {}, expected text in quotes", value_text(*node)));
      return;
    }
    value = *node->value<std::string>();
  }
  keep(nodes_->effective, name, value);
}

void Section::texts(std::string_view name, std::vector<std::string>& values, const TextKey& key) {
  OCU_LOOK_UP_OR_RETURN("texts", "", "a list of texts", fmt::format("{} entries", values.size()))
  if (node != nullptr) {
    const auto* array = node->as_array();
    if (array == nullptr) {
      fault(name, fmt::format("is {}, expected a list of texts", value_text(*node)));
      return;
    }
    std::vector<std::string> found;
    for (const auto& entry : *array) {
      if (!entry.is_string()) {
        fault(name, fmt::format("holds {}, expected texts only", value_text(entry)));
        return;
      }
      found.push_back(*entry.value<std::string>());
    }
    values = std::move(found);
  }
  toml::array kept;
  for (const auto& v : values) kept.push_back(v);
  keep(nodes_->effective, name, kept);
}

void Section::file(std::string_view name, std::filesystem::path& value, const TextKey& key) {
  std::string given = value.string();
  const std::size_t before = reader_->state_->faults.size();
  text(name, given, key);
  if (listing() || given.empty() || reader_->state_->faults.size() != before) return;
  const auto& state = *reader_->state_;
  std::vector<std::filesystem::path> tried;
  if (std::filesystem::path(given).is_absolute()) {
    tried.emplace_back(given);
  } else {
    if (!state.mesh_directory.empty()) tried.push_back(state.mesh_directory / given);
    tried.push_back(state.case_file.parent_path() / given);
  }
  for (const auto& candidate : tried)
    if (std::filesystem::is_regular_file(candidate)) {
      value = candidate;
      return;
    }
  std::string places;
  for (const auto& candidate : tried) places += (places.empty() ? "" : ", ") + candidate.string();
  fault(name, fmt::format("no such file: '{}' (looked at {}); cases/run makes the meshes of a case",
                          given, places));
}

std::size_t Section::choice_index(std::string_view name, std::size_t fallback,
                                  std::span<const std::string_view> accepted, const TextKey& key) {
  std::string words;
  for (const auto& word : accepted) words += (words.empty() ? "" : ", ") + std::string(word);
  auto& state = *reader_->state_;
  state.known[path_].insert(std::string(name));
  if (state.listing) {
    state.keys.push_back(
        describe(join(path_, name), "word", "", words, key.required, accepted[fallback], key.help));
    return fallback;
  }
  const toml::node* node = nodes_->table != nullptr ? nodes_->table->get(name) : nullptr;
  if (node == nullptr) {
    if (key.required) fault(name, fmt::format("missing, accepted: {}: {}", words, key.help));
  } else {
    const auto found = node->value<std::string>();
    const auto at = found ? std::find(accepted.begin(), accepted.end(), *found) : accepted.end();
    if (at == accepted.end()) {
      const std::string nearest =
          found ? nearest_word(*found, {accepted.begin(), accepted.end()}) : std::string();
      fault(name, fmt::format("is {}, accepted: {}{}", value_text(*node), words,
                              nearest.empty() ? "" : "; did you mean '" + nearest + "'?"));
      return fallback;
    }
    fallback = static_cast<std::size_t>(at - accepted.begin());
  }
  keep(nodes_->effective, name, std::string(accepted[fallback]));
  return fallback;
}

Section Section::table(std::string_view name, std::string_view help) {
  auto& state = *reader_->state_;
  state.known[path_].insert(std::string(name));
  auto nodes = std::make_shared<Nodes>();
  const std::string full = join(path_, name);
  if (state.listing) state.keys.push_back(fmt::format("[{}]  {}", full, help));
  if (nodes_->table != nullptr)
    if (const auto* node = nodes_->table->get(name)) {
      nodes->table = node->as_table();
      if (nodes->table == nullptr) fault(name, "expected a table");
    }
  if (nodes->table != nullptr && nodes_->effective != nullptr)
    nodes->effective =
        nodes_->effective->insert_or_assign(name, toml::table{}).first->second.as_table();
  return {*reader_, full, std::move(nodes)};
}

void Section::tables(std::string_view name, std::string_view help,
                     const std::function<void(Section&, std::size_t)>& read) {
  auto& state = *reader_->state_;
  state.known[path_].insert(std::string(name));
  const std::string full = join(path_, name);
  if (state.listing) {
    state.keys.push_back(fmt::format("[[{}]]  {}", full, help));
    Section entry(*reader_, full, std::make_shared<Nodes>());
    read(entry, 0);
    return;
  }
  const toml::node* node = nodes_->table != nullptr ? nodes_->table->get(name) : nullptr;
  if (node == nullptr) return;
  const auto* array = node->as_array();
  if (array == nullptr || !array->is_array_of_tables()) {
    fault(name, fmt::format("expected tables [[{}]]", full));
    return;
  }
  auto* kept = nodes_->effective->insert_or_assign(name, toml::array{}).first->second.as_array();
  for (std::size_t i = 0; i < array->size(); ++i) kept->push_back(toml::table{});
  for (std::size_t i = 0; i < array->size(); ++i) {
    auto nodes = std::make_shared<Nodes>();
    nodes->table = array->get(i)->as_table();
    nodes->effective = kept->get(i)->as_table();
    Section entry(*reader_, full, std::move(nodes));
    read(entry, i);
  }
}

#undef OCU_LOOK_UP_OR_RETURN

}  // namespace ocublast
