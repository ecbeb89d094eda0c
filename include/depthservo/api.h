#pragma once

/// `DEPTHSERVO_API`: what a shared library offers its users, that is, what has code of its own in
/// these headers. Everything else in a library is hidden.
/// `DEPTHSERVO_INNER`: no part of the interface, but needed by another library of depthservo, the
/// tool or a test. It may change at any time.
#define DEPTHSERVO_API __attribute__((visibility("default")))
#define DEPTHSERVO_INNER __attribute__((visibility("default")))
