#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "solid_solver/io/mesh_file.hpp"
#include "tests/support/solid_meshes.hpp"

namespace ocublast::solid::test {

/// A folder that goes away with its test.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "ocublast_solid_XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

struct Outcome {
  int code = 0;
  std::string text;  ///< standard output and error
};

/// Runs a command line by the shell.
inline Outcome run_command(const std::string& command) {
  Outcome outcome;
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  char buffer[4096];
  while (std::fgets(buffer, sizeof buffer, pipe) != nullptr) outcome.text += buffer;
  outcome.code = WEXITSTATUS(pclose(pipe));
  return outcome;
}

inline void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
}

inline std::string read_text(const std::filesystem::path& file) {
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// Columns of a CSV file by name.
inline std::map<std::string, std::vector<double>> read_csv(const std::filesystem::path& file) {
  std::map<std::string, std::vector<double>> columns;
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  std::vector<std::string> names;
  std::stringstream header(line);
  for (std::string name; std::getline(header, name, ',');) names.push_back(name);
  while (std::getline(in, line)) {
    std::stringstream row(line);
    std::string value;
    for (const auto& name : names) {
      std::getline(row, value, ',');
      columns[name].push_back(std::stod(value));
    }
  }
  return columns;
}

inline const char* case_head =
    "[case]\nname = \"test\"\ntitle = \"test\"\n[ambient]\npressure_Pa = 101325.0\ntemperature_K = "
    "293.0\n";
inline const char* case_material =
    "[[solid.material]]\nname = \"soft\"\ntissues = [\"block\"]\nlaw = "
    "\"neo_hookean\"\ndensity_kg_m3 = 1000.0\n"
    "shear_modulus_Pa = 1e5\nbulk_modulus_Pa = 1e7\n";

}  // namespace ocublast::solid::test
