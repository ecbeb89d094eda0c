#pragma once

#include <string>

#include "depthservo/api.h"
#include "depthservo/rig/observe.h"
#include "depthservo/sequence/SequenceWriter.h"

namespace depthservo {

/// Writes what the sensors of a rig give, and what is true where it is known, as a sequence.
class DEPTHSERVO_API SequenceRecorder : public RunWatcher {
 public:
  /// \param folder must not exist; whole or not at all \param next watches, too; may be null
  /// \throw InputError
  explicit SequenceRecorder(const std::string& folder, RunWatcher* next = nullptr)
      : writer_(folder), next_(next) {}

  /// From now on commands are written, too.
  void keepCommands() { keepsCommands_ = true; }

  bool onFrame(const RunFrame& frame) override;
  void finish(const SequenceSettings& settings) { writer_.finish(settings); }

 private:
  SequenceWriter writer_;
  RunWatcher* next_;
  bool keepsCommands_ = false;
  std::size_t rows_ = 0;
  double lastRow_s_ = kUnknown;
};

}  // namespace depthservo
