#pragma once

#include <spdlog/spdlog.h>

#include <filesystem>
#include <memory>
#include <string>

namespace ocublast {

/// Logger of one program: warnings and errors to standard error, everything to `file` if not empty
/// (its folder is created).
[[nodiscard]] std::shared_ptr<spdlog::logger> make_logger(const std::string& program,
                                                          const std::filesystem::path& file);

}  // namespace ocublast
