"""What everything in artperl builds on: rotations, trees and poses, shapes, clouds, estimates."""
