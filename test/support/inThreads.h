#pragma once

#include <functional>
#include <thread>
#include <vector>

namespace depthservo::test {

constexpr int kThreads = 3;

/// Does the work in as many threads at once, each with its number.
inline void inThreads(const std::function<void(int)>& work) {
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i) threads.emplace_back(work, i);
  for (std::thread& thread : threads) thread.join();
}

}  // namespace depthservo::test
