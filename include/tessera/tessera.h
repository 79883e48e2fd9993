#pragma once

// The whole public interface: read a scene, describe a machine, make a device, render frames.
#include <tessera/device.h>
#include <tessera/error.h>
#include <tessera/frame.h>
#include <tessera/keys.h>
#include <tessera/scene.h>
