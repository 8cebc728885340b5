!> The check `agreement`: how far two measurements of the chart `cost`, one after the other, agree.
module frb_chart_agreement
    use frb, only: wp
    use frb_chart_cost, only: measure_cost
    use frb_chart_methods, only: method, catalogue
    use frb_chart_output, only: chart_file, settings, open_table, say
    implicit none
    private

    public :: chart_agreement

    !> Two ratios agree if they differ by no more than this part of the smaller one.
    real(wp), parameter :: allowed = 0.15_wp
    !> The column of the cost table with the median of the time relative to the cheapest Moser-Veselov.
    integer, parameter :: relative = 5

contains

    !> Measures twice and compares the ratios; a row per method and step.
    subroutine chart_agreement(options)
        type(settings), intent(in) :: options
        type(method), allocatable :: methods(:)
        real(wp), allocatable :: first(:, :, :), second(:, :, :), apart(:, :)
        character(160) :: line
        type(chart_file) :: file
        integer :: i, k, worst(2)

        allocate (methods, source=catalogue())
        call measure_cost(options, 'agreement, first', methods, first)
        call measure_cost(options, 'agreement, second', methods, second)
        allocate (apart(size(first, 2), size(first, 3)))
        apart = max(first(relative, :, :)/second(relative, :, :), &
                    second(relative, :, :)/first(relative, :, :)) - 1
        call open_table(options, 'agreement', 'two measurements of the cost chart, one after the other', &
            'method, h*omega, time relative to the cheapest dmv: first, second; how far they are apart', file)
        do i = 1, size(methods)
            do k = 1, size(first, 3)
                write (file%line, '(a14,es12.4,2f10.4,f9.4)') methods(i)%key, first(1, i, k), &
                    first(relative, i, k), second(relative, i, k), apart(i, k)
                call file%put()
            end do
        end do
        call file%finish()
        worst = maxloc(apart)
        write (line, '(2x,i0,a,i0,a,i0,a)') count(apart <= allowed), ' of ', size(apart), &
            ' ratios agree within ', nint(100*allowed), ' %'
        call say(trim(line))
        associate (i => worst(1), k => worst(2))
            write (line, '(a,es8.1,2(a,f8.4),a,f5.1,a)') '  farthest apart: '//trim(methods(i)%key)// &
                ' at h omega =', first(1, i, k), ':', first(relative, i, k), ' and', &
                second(relative, i, k), ',', 100*apart(i, k), ' %'
        end associate
        call say(trim(line))
    end subroutine chart_agreement

end module frb_chart_agreement
