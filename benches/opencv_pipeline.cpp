// The usual way: every frame to BGR, red minus grey, a threshold, connected components. One line a frame, as a tracker would keep.
#include <cstdio>
#include <vector>

#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

int main(int argc, char **argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: opencv_pipeline VIDEO\n");
        return 2;
    }
    cv::VideoCapture video(argv[1], cv::CAP_FFMPEG);
    if (!video.isOpened()) {
        std::fprintf(stderr, "%s: cannot be opened\n", argv[1]);
        return 2;
    }
    cv::Mat frame, grey, red, mask, labels, statistics, centroids;
    std::vector<cv::Mat> channels;
    long frames = 0, marks = 0;
    while (video.read(frame)) {
        cv::split(frame, channels);
        cv::cvtColor(frame, grey, cv::COLOR_BGR2GRAY);
        cv::subtract(channels[2], grey, red);
        cv::threshold(red, mask, 60, 255, cv::THRESH_BINARY);
        const int components = cv::connectedComponentsWithStats(mask, labels, statistics, centroids);
        for (int i = 1; i < components; ++i)
            marks += statistics.at<int>(i, cv::CC_STAT_AREA) >= 30;
        ++frames;
    }
    std::printf("%ld frames, %ld marks\n", frames, marks);
}
