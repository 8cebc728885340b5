!> The chart `triangle`: the paper's figure 5 made again, errors of one step h = 1 over all shapes of a body.
module frb_chart_triangle
    use frb, only: wp
    use frb_chart_methods, only: method, find_method, known, escaped
    use frb_chart_output, only: chart_file, width, settings, open_table, open_script, draw, progress, &
        say, either, &
        random_direction
    use frb_chart_truth, only: free_case, new_case, errors_of
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
    use, intrinsic :: iso_fortran_env, only: int64
    implicit none
    private

    public :: chart_triangle

    real(wp), parameter :: floor_of_errors = 1.0e-17_wp
    character(*), parameter :: wanted(3) = [character(12) :: 'frb_step', 'quat_step', 'flow']

contains

    !> First with momenta in the first octant, as the paper has them, then with momenta in all octants.
    subroutine chart_triangle(options)
        type(settings), intent(in) :: options

        call one_triangle(options, 'triangle', .true., 'momenta in the first octant')
        call one_triangle(options, 'triangle-octants', .false., 'momenta in all octants')
    end subroutine chart_triangle

    subroutine one_triangle(options, name, first_octant, title)
        type(settings), intent(in) :: options
        character(*), intent(in) :: name, title
        logical, intent(in) :: first_octant
        type(method), allocatable :: methods(:)
        real(wp), allocatable :: directions(:, :), logs(:, :), maps(:, :, :)
        real(wp) :: x, y, error_m, error_q
        type(free_case) :: item
        integer(int64) :: seed
        type(chart_file) :: file
        integer :: nx, ny, momenta, i, j, k, c
        character(160) :: line

        allocate (methods, source=pack([(find_method_or_none(wanted(i)), i=1, 3)], [(known(wanted(i)), i=1, &
            3)]))
        nx = merge(20, 100, options%quick)
        ny = nx/2
        momenta = merge(4, 20, options%quick)
        allocate (directions(3, momenta), logs(momenta, size(methods)), maps(2*size(methods), nx, ny))
        seed = 5550123_int64
        do c = 1, momenta
            call random_direction(seed, directions(:, c))
            if (first_octant) directions(:, c) = abs(directions(:, c))
        end do
        maps = ieee_value(x, ieee_quiet_nan)
        do i = 1, nx
            x = (i - 0.5_wp)/nx
            do j = 1, ny
                y = 0.5_wp + 0.5_wp*(j - 0.5_wp)/ny
                if (x < 1 - y .or. x >= y) cycle
                do c = 1, momenta
                    item = new_case([x, y, 1.0_wp], directions(:, c), 1.0_wp)
                    do k = 1, size(methods)
                        call errors_of(methods(k), item, 1, error_m, error_q)
                        logs(c, k) = log10(min(10.0_wp, max(floor_of_errors, hypot(error_m, error_q))))
                    end do
                end do
                do k = 1, size(methods)
                    maps(2*k - 1, i, j) = sum(logs(:, k))/momenta
                    maps(2*k, i, j) = maxval(logs(:, k))
                end do
            end do
            call progress(options, name, i, nx)
        end do
        call open_table(options, name, &
            'log10 of the error of one step h = 1, |m| = 1, over the shapes of a body, '// &
            title, 'I1/I3, I2/I3, then mean and largest log10 of the error for '//names_of(methods), file)
        do j = 1, ny
            do i = 1, nx
                write (file%line, '(2f9.5,8f9.3)') (i - 0.5_wp)/nx, 0.5_wp + 0.5_wp*(j - 0.5_wp)/ny, &
                    maps(:, i, j)
                call file%put()
            end do
        end do
        do k = 1, size(methods)
            write (line, '(2(a,f7.2))') '# '//methods(k)%key//' mean over the triangle ', &
                mean_of(maps(2*k - 1, :, :)), ', largest ', largest_of(maps(2*k, :, :))
            call file%put(trim(line))
            call say('  '//trim(line(3:)))
        end do
        call file%finish()
        call draw_triangle(options, methods, name, title)
    end subroutine one_triangle

    function find_method_or_none(key) result(found)
        character(*), intent(in) :: key
        type(method) :: found

        if (known(key)) found = find_method(trim(key))
    end function find_method_or_none

    function names_of(methods) result(text)
        type(method), intent(in) :: methods(:)
        character(:), allocatable :: text
        integer :: k

        text = trim(methods(1)%key)
        do k = 2, size(methods)
            text = text//', '//trim(methods(k)%key)
        end do
    end function names_of

    pure function mean_of(map) result(mean)
        real(wp), intent(in) :: map(:, :)
        real(wp) :: mean

        mean = sum(map, mask=map < 100.0_wp)/max(1, count(map < 100.0_wp))
    end function mean_of

    pure function largest_of(map) result(largest)
        real(wp), intent(in) :: map(:, :)
        real(wp) :: largest

        largest = maxval(map, mask=map < 100.0_wp)
    end function largest_of

    subroutine draw_triangle(options, methods, name, title)
        type(settings), intent(in) :: options
        type(method), intent(in) :: methods(:)
        character(*), intent(in) :: name, title
        character(*), parameter :: which(2) = [character(7) :: 'mean', 'largest']
        type(chart_file) :: file
        integer :: k, row
        real(wp) :: left

        call open_script(options, name, 1000, 560, file)
        call file%put('set multiplot title "log10 of the error of one step h = 1, '//title//'"')
        call file%put_lines([character(width) :: &
            'set palette defined (0 "#fde725", 1 "#5ec962", 2 "#21918c", 3 "#3b528b", 4 "#440154")', &
            'set cbrange [-16.5:-13.5]', 'set xrange [0:1]', 'set yrange [0.5:1]', 'set xtics 0.25', &
            'set ytics 0.1', 'unset key', 'set lmargin 0; set rmargin 0; set tmargin 0; set bmargin 0', &
            'set cbtics 0.5', 'set colorbox user origin 0.93,0.13 size 0.018,0.72'])
        do row = 1, 2
            do k = 1, size(methods)
                left = 0.075_wp + 0.285_wp*(k - 1)
                write (file%line, '(a,f6.4,a,f6.4)') 'set origin ', left, ',', merge(0.55_wp, 0.11_wp, &
                    row == 1)
                call file%put()
                call file%put('set size 0.25,0.32')
                call file%put('set title "'//escaped(methods(k)%label)//', '//trim(which(row))// &
                    '" offset 0,-0.6')
                call file%put(either(k == 1, 'set ylabel "I_2/I_3" offset 1,0', 'unset ylabel'))
                call file%put(either(row == 2, 'set xlabel "I_1/I_3" offset 0,0.5', 'unset xlabel'))
                write (file%line, '(a,i0,a)') 'plot "'//name//'.dat" using 1:2:', 2*k + row, ' with image'
                call file%put()
                call file%put('unset colorbox')
            end do
        end do
        call file%put('unset multiplot')
        call file%finish()
        call draw(options, name)
    end subroutine draw_triangle

end module frb_chart_triangle
