"""All objects in one image with depth: detections, clouds of each, estimates of all their parts."""
