#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace bsp2::io {

/// ".apng, .gif, .mp4 or .webm", for messages.
[[nodiscard]] std::string animation_endings();
/// Whether a file's ending names an animation.
[[nodiscard]] bool is_animation(const std::filesystem::path& path);

/// Pictures that follow each other, in one file: .apng here, all others by ffmpeg, which is started as a
/// process of its own. The file is there when it is complete. Thread rule: one thread at a time.
class Animation {
 public:
  /// @param rate pictures a second, 0.01 to 1000. @throws bsp2::Error if the ending names no animation, or
  /// ffmpeg is not there.
  static std::unique_ptr<Animation> begin(const std::filesystem::path& path, double rate);
  /// An error of what it would need; nothing is written yet. @throws bsp2::Error likewise.
  static void check(const std::filesystem::path& path);

  Animation() = default;
  virtual ~Animation() = default;
  Animation(const Animation&) = delete;
  Animation& operator=(const Animation&) = delete;

  /// @param png the next picture, as large as the first one: the bytes of a file. @throws bsp2::Error if it
  /// cannot be written.
  virtual void add(std::string_view png) = 0;
  /// Call once, after the last picture. Without it there is no file. @throws bsp2::Error likewise.
  virtual void end() = 0;
};

}  // namespace bsp2::io
